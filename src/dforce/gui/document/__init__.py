"""The document that a person is working on: the case as typed, its history, the results kept, and computations."""
