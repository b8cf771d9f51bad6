"""The parts of scripts/site: what the pages are made of, and what is checked of them."""
