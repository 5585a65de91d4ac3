"""Curves of results: figures, the chart, the results kept, and what is read off them."""
