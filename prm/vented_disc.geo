// A vented disc for Scene = mesh: two friction plates on 21 straight vanes, hat, two sector pads with backing plates.
// Only hexahedra.
//   gmsh -3 prm/vented_disc.geo -o prm/vented_disc.msh
// Its groups are used by prm/vented_disc.prm. Lengths in mm; z is the rotor's axis, z = 0 the middle between the plates.
SetFactory("Built-in");

n_vanes = 21;
share   = 0.3;  // of a pitch that is vane
DefineConstant[ n_vane = 1, n_gap = 2 ]; // cells across a vane and across a channel

r_hub   = 35;   // clamped
r_hat   = 66;   // the hat's inner side
wall    = 6;    // thickness of the hat
r_inner = 88;   // friction plates
r_outer = 140;
edge    = 6;    // from there to the vanes
h       = 24;   // thickness of the disc
channel = 8;    // of the channels
z_hat   = 44;   // the hat's top

pad_inner = 92;
pad_outer = 137;
pad_angle = 54*Pi/180;
lining    = 10; // thicknesses
plate     = 6;

sections[] = {};
Function Section // the rectangle r_1 < r < r_2, z_1 < z < z_2 in the half plane at the angle phi, n_r times n_z cells
  p = newp;
  Point(p)   = {r_1*Cos(phi), r_1*Sin(phi), z_1}; Point(p+1) = {r_2*Cos(phi), r_2*Sin(phi), z_1};
  Point(p+2) = {r_2*Cos(phi), r_2*Sin(phi), z_2}; Point(p+3) = {r_1*Cos(phi), r_1*Sin(phi), z_2};
  c = newl;
  Line(c) = {p, p+1}; Line(c+1) = {p+1, p+2}; Line(c+2) = {p+2, p+3}; Line(c+3) = {p+3, p};
  Transfinite Curve {c, c+2} = n_r + 1;
  Transfinite Curve {c+1, c+3} = n_z + 1;
  loop = newll; Curve Loop(loop) = {c, c+1, c+2, c+3};
  f = news; Plane Surface(f) = {loop};
  Transfinite Surface {f}; Recombine Surface {f};
  sections[] += f;
Return

// The rotor's section. The first is at the hub; 5 to 7 are the upper plate, 8 to 10 the lower one, 11 is the vane.
phi = 0;
n_z = 1;
r_1 = r_hub;           r_2 = r_hat;           z_1 = z_hat - wall; z_2 = z_hat;        n_r = 2; Call Section;
r_1 = r_hat;           r_2 = r_hat + wall;                                            n_r = 1; Call Section;
z_1 = h/2;             z_2 = z_hat - wall;    n_z = 2;                                         Call Section;
z_1 = channel/2;       z_2 = h/2;             n_z = 1;                                         Call Section;
r_1 = r_hat + wall;    r_2 = r_inner;                                                          Call Section;
r_1 = r_inner;         r_2 = r_inner + edge;                                                   Call Section;
r_1 = r_inner + edge;  r_2 = r_outer - edge;  n_r = 3;                                         Call Section;
r_1 = r_outer - edge;  r_2 = r_outer;         n_r = 1;                                         Call Section;
z_1 = -h/2;            z_2 = -channel/2;
r_1 = r_inner;         r_2 = r_inner + edge;                                                   Call Section;
r_1 = r_inner + edge;  r_2 = r_outer - edge;  n_r = 3;                                         Call Section;
r_1 = r_outer - edge;  r_2 = r_outer;         n_r = 1;                                         Call Section;
z_1 = -channel/2;      z_2 = channel/2;
r_1 = r_inner + edge;  r_2 = r_outer - edge;  n_r = 3;                                         Call Section;
Coherence;

// Rotated by a vane, by a channel, by a vane ... The vane's section is rotated too where the channels are, so that all
// steps are alike; these volumes belong to no group and are not written.
rotor[] = {}; hub[] = {}; top[] = {}; bottom[] = {};
start[] = sections[];
For step In {0:2*n_vanes-1}
  is_vane = step % 2 == 0;
  angle = 2*Pi/n_vanes*(is_vane ? share : 1 - share);
  next[] = {};
  For i In {0:#start[]-1}
    e[] = Extrude {{0, 0, 1}, {0, 0, 0}, angle} { Surface{start[i]}; Layers{is_vane ? n_vane : n_gap}; Recombine; };
    next[] += e[0];
    // e[2] ... e[5] lie on the section's lower, outer, upper, inner curve.
    If (i < 11 || is_vane)
      rotor[] += e[1];
    EndIf
    If (i == 0)
      hub[] += e[5];
    EndIf
    If (i >= 5 && i <= 7)
      top[] += e[4];
    EndIf
    If (i >= 8 && i <= 10)
      bottom[] += e[2];
    EndIf
  EndFor
  start[] = next[];
EndFor

// Gmsh does not come back to the rest of a line after a call.
phi = -pad_angle/2;
r_1 = pad_inner; r_2 = pad_outer; n_r = 3; n_z = 1;
Function Layer // of a pad, z_1 < z < z_2; e[1] is the volume, e[2] and e[4] are its faces at z_1 and z_2
  Call Section;
  e[] = Extrude {{0, 0, 1}, {0, 0, 0}, pad_angle} { Surface{f}; Layers{8}; Recombine; };
Return
z_1 = h/2; z_2 = h/2 + lining;
Call Layer;
Physical Volume("upper lining") = {e[1]}; Physical Surface("upper face") = {e[2]};
z_1 = z_2; z_2 = z_1 + plate;
Call Layer;
Physical Volume("upper plate") = {e[1]}; Physical Surface("upper back") = {e[4]};
z_1 = -h/2 - lining; z_2 = -h/2;
Call Layer;
Physical Volume("lower lining") = {e[1]}; Physical Surface("lower face") = {e[4]};
z_2 = z_1; z_1 = z_2 - plate;
Call Layer;
Physical Volume("lower plate") = {e[1]}; Physical Surface("lower back") = {e[2]};
Coherence;

Physical Volume("rotor") = rotor[];
Physical Surface("hub") = hub[];
Physical Surface("disc top") = top[];
Physical Surface("disc bottom") = bottom[];

Mesh.ElementOrder = 1;
Mesh.MshFileVersion = 4.1;
