"""Many runs of one deck with other values: on this machine or as a Slurm job array, gathered into one file and drawn."""
