"""The contract every Touchline process builds to: messages, topics, templates, vehicles and curve maths."""
