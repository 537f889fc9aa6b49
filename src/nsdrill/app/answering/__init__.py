"""What results answer: the window and its trials, changes that would help, summaries,
attractors."""
