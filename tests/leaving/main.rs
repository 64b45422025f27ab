//! Where rays leave a surface of revolution, from which side they meet it, and what is inside it.

mod edges;
mod membership;
mod starts;
mod support;
