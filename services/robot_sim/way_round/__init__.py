"""Ways round what stands in the way of a job: waiting, the rest of the job, and the return to what was left out."""
