//! The laboratory: experiments, claims, goldens and the page that shows them.

mod axis;
pub mod claim;
pub mod contrast;
pub mod difference;
pub mod experiment;
pub mod families;
pub mod golden;
pub mod grade;
pub mod join;
pub mod machine;
pub mod page;
pub mod plot;
pub mod progress;
pub mod record;
pub mod rendering;
pub mod report;
pub mod runner;
pub mod showcase;
pub mod suite;
pub mod svg;
pub mod table;
pub mod versus;
