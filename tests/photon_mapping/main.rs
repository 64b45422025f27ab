//! Claims about photon mapping against closed forms. Statistical ones use fixed seeds and six standard errors (a false alarm of
//! 2e-9 each) and state the effect they can see.

mod acceptance;
mod aim;
mod cases;
mod caustic;
mod command;
mod energy;
mod kernels;
mod limits;
mod nadir;
mod rooms;
mod scenes;
mod view;
