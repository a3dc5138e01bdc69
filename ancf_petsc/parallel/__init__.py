"""Who owns what: slabs, partition, numbering, exchange between ranks."""
