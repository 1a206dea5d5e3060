"""`vfi init`: a first scene for an arm that is not in the project, which passes `vfi check` and runs at once."""
