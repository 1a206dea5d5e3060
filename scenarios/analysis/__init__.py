"""What happened in a run: the trace, the metrics, the figures."""
