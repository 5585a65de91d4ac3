"""Curves of results: figures, the chart, the results kept, and the values read from them."""
