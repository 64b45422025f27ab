//! The laboratory: experiments, claims, goldens and the page that shows them.

pub mod claim;
pub mod difference;
pub mod experiment;
pub mod page;
pub mod plot;
