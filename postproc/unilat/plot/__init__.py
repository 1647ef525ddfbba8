"""Pictures of result files, one module a command of unilat-plot."""
