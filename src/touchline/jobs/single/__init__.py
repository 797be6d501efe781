"""One robot on one template, from plan to report, in this process or over the bus; reports and pictures."""
