"""The discrete problem: what is held, what is loaded, and the forces and tangents between them."""
