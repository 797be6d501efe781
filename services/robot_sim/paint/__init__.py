"""True paint: the ledger of the nozzle and the figures computed from it."""
