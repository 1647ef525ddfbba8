"""Result files in other forms, one module a command of unilat-plot."""
