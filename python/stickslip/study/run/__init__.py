"""The campaign of a study: who computes the samples, and the store that keeps them."""
