"""Training of the codec's prior, on clips with a licence that allows it."""
