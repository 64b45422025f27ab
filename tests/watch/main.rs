//! What a render shows beside the finished colours: feature channels, the live page, the picture in the tev viewer.

mod features;
mod live;
mod support;
mod tev;
