//! Roots of the degree-6 polynomial, isolated in Bernstein form: the default solver.
