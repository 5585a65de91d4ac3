"""Results: Datasets with units, status and provenance (``dataset``), their stores, and the curves that they hold."""
