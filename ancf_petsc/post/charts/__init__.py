"""Charts of studies, from study.csv, study.json and the tables of the runs; each with its numbers as CSV."""
