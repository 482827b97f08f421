"""What a fit is worth: residuals, expected error, observability, comparison, and the report."""
