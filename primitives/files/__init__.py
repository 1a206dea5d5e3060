"""How declarations stand in YAML files: reading within bounds, errors with file and line, and writing without loss."""
