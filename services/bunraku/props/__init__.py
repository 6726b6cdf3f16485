"""Props from files: models that are held in a hand or lie on the floor."""
