"""What a measurement may do to a trial between the muscle and the file: nuisances of fits, rivals of physics."""
