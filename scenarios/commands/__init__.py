"""Commands of `vfi` that have a file of their own; `scenarios.cli` registers them."""
