"""The report of a diagnosis: record and traces in files, and what they say in words, figures and a page."""
