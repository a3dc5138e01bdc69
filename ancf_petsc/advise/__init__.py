"""Advice on a case: the cheapest element, mesh and step within an error, from a ladder of cheap runs."""
