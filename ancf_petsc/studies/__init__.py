"""Studies: many runs of a case with some of its keys varied, their table, references and fitted orders."""
