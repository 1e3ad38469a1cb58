// A disc brake for Scene = mesh: rotor with hat, two pads, each a lining on a steel backing plate. Only hexahedra.
//   gmsh -3 prm/realistic_brake.geo -o prm/realistic_brake.msh
// Its groups are used by prm/realistic_brake.prm. Lengths in mm; z is the rotor's axis, z = 0 the middle of its friction ring.
SetFactory("Built-in");

// Rotor: sections of half planes phi = const, rotated
r_hub    = 35;   // hub ring, clamped
r_hat    = 72;   // the hat's outer side
r_inner  = 88;   // friction ring
r_outer  = 140;
h        = 11;   // thickness of the friction ring
wall     = 6;    // of the hat
z_hat    = 38;   // the hat's top
n_angle  = 9;    // cells in each quarter
n_ring   = 4;    // cells across the friction ring

// Pads
pad_mid    = 114;        // radius of the pad's middle, where the piston presses
pad_radial = 46;         // extent along the radius
pad_angle  = 56*Pi/180;
lining     = 10;         // thicknesses
plate      = 6;
piston_out = 17;         // the rim of the piston's cup presses on a ring
piston_in  = 11;
n_side     = 3;          // cells along each quarter of the piston's rim
n_end      = 2;          // cells from there to the edge of the pad
n_lining   = 1;          // layers of cells
n_plate    = 1;

// The section: columns of radii, rows of z
p = newp;
Point(p)    = {r_hub, 0, z_hat - wall};         Point(p+1)  = {r_hub, 0, z_hat};
Point(p+2)  = {r_hat - wall, 0, z_hat - wall};  Point(p+3)  = {r_hat - wall, 0, z_hat};
Point(p+4)  = {r_hat, 0, z_hat - wall};         Point(p+5)  = {r_hat, 0, z_hat};
Point(p+6)  = {r_hat - wall, 0, h/2};           Point(p+7)  = {r_hat, 0, h/2};
Point(p+8)  = {r_hat - wall, 0, -h/2};          Point(p+9)  = {r_hat, 0, -h/2};
Point(p+10) = {r_inner, 0, h/2};                Point(p+11) = {r_inner, 0, -h/2};
Point(p+12) = {r_outer, 0, h/2};                Point(p+13) = {r_outer, 0, -h/2};

Function Quadrilateral // of curves l[], n_1 cells on l[0] and l[2], n_2 on l[1] and l[3]
  Transfinite Curve {Abs(l[0]), Abs(l[2])} = n_1 + 1;
  Transfinite Curve {Abs(l[1]), Abs(l[3])} = n_2 + 1;
  loop = newll; Curve Loop(loop) = {l[]};
  f = news; Plane Surface(f) = {loop};
  Transfinite Surface {f}; Recombine Surface {f};
Return

Function Section // of points q[], n_1 cells along q[0] q[1], n_2 along q[1] q[2]
  c = newl;
  Line(c) = {q[0], q[1]}; Line(c+1) = {q[1], q[2]}; Line(c+2) = {q[2], q[3]}; Line(c+3) = {q[3], q[0]};
  l[] = {c, c+1, c+2, c+3};
  Call Quadrilateral;
  sections[] += f;
Return

sections[] = {};
q[] = {p, p+2, p+3, p+1};      n_1 = 3; n_2 = 1;      Call Section; // the hat's top
q[] = {p+2, p+4, p+5, p+3};    n_1 = 1; n_2 = 1;      Call Section; // its corner
q[] = {p+6, p+7, p+4, p+2};    n_1 = 1; n_2 = 3;      Call Section; // its wall
q[] = {p+8, p+9, p+7, p+6};    n_1 = 1; n_2 = 1;      Call Section; // below the wall
q[] = {p+9, p+11, p+10, p+7};  n_1 = 1; n_2 = 1;      Call Section; // the neck
q[] = {p+11, p+13, p+12, p+10}; n_1 = n_ring; n_2 = 1; Call Section; // the friction ring
Coherence;

rotor[] = {}; hub[] = {}; top[] = {}; bottom[] = {};
start[] = sections[];
For quarter In {0:3}
  next[] = {};
  For i In {0:#start[]-1}
    e[] = Extrude {{0, 0, 1}, {0, 0, 0}, Pi/2} { Surface{start[i]}; Layers{n_angle}; Recombine; };
    next[] += e[0];
    rotor[] += e[1];
    // e[2] ... e[5] lie on the section's four curves.
    If (i == 0)
      hub[] += e[5];
    EndIf
    If (i == 5)
      bottom[] += e[2];
      top[] += e[4];
    EndIf
  EndFor
  start[] = next[];
EndFor

// A pad: a square inside of the piston's rim, four blocks to the rim, four on it, four to the edge.
Function Pad // on the plane z_face, towards up = 1 or -1
  axis = newp; Point(axis) = {0, 0, z_face};
  centre = newp; Point(centre) = {pad_mid, 0, z_face};
  a = newp;
  For k In {0:3} // at 45, 135, 225, 315 degrees about the piston's axis
    u = Cos(Pi/4 + k*Pi/2); v = Sin(Pi/4 + k*Pi/2);
    Point(a + k)     = {pad_mid + piston_in*0.5*u, piston_in*0.5*v, z_face};
    Point(a + 4 + k) = {pad_mid + piston_in*u, piston_in*v, z_face};
    Point(a + 8 + k) = {pad_mid + piston_out*u, piston_out*v, z_face};
    r = pad_mid + (u > 0 ? 1 : -1)*pad_radial/2; phi = (v > 0 ? 1 : -1)*pad_angle/2;
    Point(a + 12 + k) = {r*Cos(phi), r*Sin(phi), z_face};
  EndFor
  c = newl;
  For k In {0:3}
    m = (k + 1) % 4;
    Line(c + k) = {a + k, a + m};
    Circle(c + 4 + k) = {a + 4 + k, centre, a + 4 + m};
    Circle(c + 8 + k) = {a + 8 + k, centre, a + 8 + m};
    If (k % 2 == 0) // the ends of the pad, then its inner and outer edge
      Line(c + 12 + k) = {a + 12 + k, a + 12 + m};
    Else
      Circle(c + 12 + k) = {a + 12 + k, axis, a + 12 + m};
    EndIf
    For ring In {0:2}
      Line(c + 16 + 4*ring + k) = {a + 4*ring + k, a + 4*ring + 4 + k};
    EndFor
  EndFor
  base[] = {};
  l[] = {c, c+1, c+2, c+3}; n_1 = n_side; n_2 = n_side;
  Call Quadrilateral; // Gmsh does not come back to the rest of this line
  base[] += f;
  For ring In {0:2}
    For k In {0:3}
      l[] = {c + 4*ring + k, c + 16 + 4*ring + (k + 1) % 4, -(c + 4*ring + 4 + k), -(c + 16 + 4*ring + k)};
      n_1 = n_side; n_2 = ring == 2 ? n_end : 1;
      Call Quadrilateral;
      base[] += f;
    EndFor
  EndFor

  linings[] = {}; plates[] = {}; piston[] = {}; abutments[] = {};
  For i In {0:#base[]-1}
    e[] = Extrude {0, 0, up*lining} { Surface{base[i]}; Layers{n_lining}; Recombine; };
    linings[] += e[1];
    g[] = Extrude {0, 0, up*plate} { Surface{e[0]}; Layers{n_plate}; Recombine; };
    plates[] += g[1];
    If (i >= 5 && i <= 8) // on the piston's rim
      piston[] += g[0];
    EndIf
    If (i == 9 || i == 11) // at the ends
      abutments[] += g[4];
    EndIf
  EndFor
Return

z_face = h/2; up = 1; Call Pad;
Physical Volume("upper lining") = linings[];
Physical Volume("upper plate") = plates[];
Physical Surface("upper face") = base[];
Physical Surface("upper piston") = piston[];
Physical Surface("upper abutments") = abutments[];

z_face = -h/2; up = -1; Call Pad;
Physical Volume("lower lining") = linings[];
Physical Volume("lower plate") = plates[];
Physical Surface("lower face") = base[];
Physical Surface("lower piston") = piston[];
Physical Surface("lower abutments") = abutments[];

Physical Volume("rotor") = rotor[];
Physical Surface("hub") = hub[];
Physical Surface("disc top") = top[];
Physical Surface("disc bottom") = bottom[];

Mesh.ElementOrder = 1;
Mesh.MshFileVersion = 4.1;
