// The scene still.toml as `photolathe export` writes it for POV-Ray 3.7: colours and pixels are linear RGB.
// Note: POV-Ray shows direct light, mirrors and refraction, no light from surface to surface and no caustics: compare with --integrator whitted.
#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 20 adc_bailout 1e-4 }
#default { finish { ambient 0 emission 0 diffuse 0 specular 0 phong 0 } }

camera {
  location <0.0, 2.6, 7.0>
  direction <0.0, -0.44928616026802776, -1.5725015609380972>
  right <0.9999999999999999, 0.0, 0.0>
  up <0.0, 0.9615239476408232, -0.274721127897378>
}
light_source { <3.5, 6.0, 5.0> rgb <93620554759.93846, 93620554759.93846, 93620554759.93846> fade_distance 1.4866068747318505e-5 fade_power 2 }

// hourglass
lathe { bezier_spline 24,
  <0.0, -1.0> <0.27, -1.0> <0.53, -1.0> <0.8, -1.0>,
  <0.8, -1.0> <0.8, -0.8> <0.7, -0.57> <0.55, -0.45>,
  <0.55, -0.45> <0.4, -0.33> <0.15, -0.15> <0.15, 0.0>,
  <0.15, 0.0> <0.15, 0.15> <0.4, 0.33> <0.55, 0.45>,
  <0.55, 0.45> <0.7, 0.57> <0.8, 0.8> <0.8, 1.0>,
  <0.8, 1.0> <0.53, 1.0> <0.27, 1.0> <0.0, 1.0>
  matrix <0.85, 0.0, 0.0, 0.0, 0.85, 0.0, 0.0, 0.0, 0.85, -1.2, 0.851, -0.2>
  pigment { rgbt 1 } finish { reflection { 0 1 fresnel on } conserve_energy }
  interior { ior 1.5 } no_shadow }
lathe { bezier_spline 24,
  <0.0, -1.0> <0.27, -1.0> <0.53, -1.0> <0.8, -1.0>,
  <0.8, -1.0> <0.8, -0.8> <0.7, -0.57> <0.55, -0.45>,
  <0.55, -0.45> <0.4, -0.33> <0.15, -0.15> <0.15, 0.0>,
  <0.15, 0.0> <0.15, 0.15> <0.4, 0.33> <0.55, 0.45>,
  <0.55, 0.45> <0.7, 0.57> <0.8, 0.8> <0.8, 1.0>,
  <0.8, 1.0> <0.53, 1.0> <0.27, 1.0> <0.0, 1.0>
  matrix <0.85, 0.0, 0.0, 0.0, 0.85, 0.0, 0.0, 0.0, 0.85, -1.2, 0.851, -0.2> pigment { rgb 0 } no_image no_reflection }

// mirror
sphere { <1.35, 0.75, -0.3>, 0.75
  texture { pigment { rgb 0 } finish { reflection { rgb <0.85, 0.85, 0.85> } } } }

// ball
sphere { <0.25, 0.3, 1.2>, 0.3
  texture { pigment { rgb <0.7, 0.2, 0.15> } finish { diffuse 1 } } }

// bead
sphere { <-0.35, 0.12, 2.0>, 0.12
  texture { pigment { rgb <0.2, 0.3, 0.7> } finish { diffuse 1 } } }

// floor
disc { <0.0, 0.0, 0.0>, <0.0, 1.0, 0.0>, 5.769991334482229
  clipped_by { box { <0, 0, -1>, <1, 1, 1> matrix <8.0, 0.0, 0.0, 0.0, 0.0, -8.0, 0.0, 11.313708498984761, 0.0, -4.0, 0.0, 4.0> } }
  texture { pigment { checker rgb <0.75, 0.75, 0.75> rgb <0.2, 0.25, 0.3> translate <0, 0, -0.5> scale <0.08333333333333333, 0.08333333333333333, 1> matrix <8.0, 0.0, 0.0, 0.0, 0.0, -8.0, 0.0, 1.0, 0.0, -4.0, 0.0, 4.0> } finish { diffuse 1 } } }

// wall
disc { <0.0, 1.6, -2.5>, <0.0, 0.0, 1.0>, 4.394294482621756
  clipped_by { box { <0, 0, -1>, <1, 1, 1> matrix <8.0, 0.0, 0.0, 0.0, 3.2, 0.0, 0.0, 0.0, 8.616263691415208, -4.0, 0.0, -2.5> } }
  texture { pigment { rgb <0.55, 0.6, 0.5> } finish { diffuse 1 } } }
