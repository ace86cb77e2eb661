"""What the recordings say: estimates of their own fits, when and how warm they were."""
