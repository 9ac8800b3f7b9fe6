"""Workers: where chunks of work run."""
