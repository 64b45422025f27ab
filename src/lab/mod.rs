//! The laboratory: experiments, claims, goldens and the page that shows them.

pub mod claim;
pub mod experiment;
pub mod plot;
