"""The verbs of the command `stickslip`, one file each."""
