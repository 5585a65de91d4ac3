"""What is measured on the motion: streamed while integrating."""
