"""What `scripts/fuzz` is made of: valid files, ways to damage them, the process that tries them, second readers."""
