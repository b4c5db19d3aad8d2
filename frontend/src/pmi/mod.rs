//! The PMI language (Sieb & Meyer SERIES 8).
