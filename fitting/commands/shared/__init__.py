"""What commands share: models and plugins read, tasks done, output printed."""
