"""What got painted: the ledger of the true nozzle and the figures drawn from it."""
