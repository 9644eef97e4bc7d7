"""Energy by complex modes: what each holds, gains and loses."""
