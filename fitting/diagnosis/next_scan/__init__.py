"""Which scan to take next: candidate scans, discrimination between hypotheses, choice."""
