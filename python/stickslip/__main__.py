"""``python -m stickslip`` is the command line."""

from stickslip.cli import main

if __name__ == "__main__":
    main(prog_name="stickslip")
