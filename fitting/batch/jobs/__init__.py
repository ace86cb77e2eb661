"""Jobs of a batch: found, listed, named by what they are made of, and watched for."""
