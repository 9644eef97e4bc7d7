"""What every part shows its results with: summaries as text and HTML, progress bars, the style of figures."""
