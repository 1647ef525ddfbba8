"""Runs held against exact values: maps of what is right, told or wrong over two parameters, and error against run time."""
