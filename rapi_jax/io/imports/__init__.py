"""From columns of numbers to a recording: clocks, units, runs cut by rate, output."""
