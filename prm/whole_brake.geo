// A whole brake for Scene = mesh: disc with hat, two pads (lining, plate, shim), piston, floating caliper, bracket.
//   gmsh -3 prm/whole_brake.geo -o prm/whole_brake.msh
// Its groups are used by prm/whole_brake.prm. Lengths in mm; z is the rotor's axis, z = 0 the middle of its friction ring.
// Disc, pads and piston are hexahedra, caliper and bracket tetrahedra. No two bodies share nodes: joints hold them together.

// Largest element and order; whole_brake_fine.geo has others before it includes this file.
If (!Exists(size))
  size = 30;
  order = 1;
EndIf

// Disc
r_hub    = 35;   // hub ring, clamped
r_hat    = 72;   // the hat's outer side
r_inner  = 88;   // friction ring
r_outer  = 140;
h        = 11;   // thickness of the friction ring
wall     = 6;    // of the hat
z_hat    = 38;   // the hat's top
n_angle  = 12;   // cells in each quarter
n_ring   = 4;    // cells across the friction ring

// Pads: sectors of rings
pad_inner  = 92;
pad_outer  = 137;
lining_end = 25*Pi/180;  // half of the lining's angle
plate_end  = 29*Pi/180;  // half of the plate's
lining     = 10;         // thicknesses
plate      = 6;
shim       = 1;
n_pad      = 12;         // cells along the pad
n_radial   = 5;          // and across

// Piston and caliper, about x = pad_mid
pad_mid   = 114;
piston_r  = 20;
cup_r     = 14;          // of the cup's hollow
cup       = 6;           // the cup's bottom
back      = h/2 + lining + plate + shim; // of the pads
piston_z  = -52;         // the piston's back
bore_z    = -56;         // the bore's bottom
housing_z = -64;         // the housing's back
finger    = 14;          // thickness of the fingers

// ---- the disc: sections of half planes phi = const, rotated
SetFactory("Built-in");
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
q[] = {p, p+2, p+3, p+1};       n_1 = 3; n_2 = 1;      Call Section; // the hat's top
q[] = {p+2, p+4, p+5, p+3};     n_1 = 1; n_2 = 1;      Call Section; // its corner
q[] = {p+6, p+7, p+4, p+2};     n_1 = 1; n_2 = 3;      Call Section; // its wall
q[] = {p+8, p+9, p+7, p+6};     n_1 = 1; n_2 = 1;      Call Section; // below the wall
q[] = {p+9, p+11, p+10, p+7};   n_1 = 1; n_2 = 1;      Call Section; // the neck
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

// ---- the pads
Function Sector // a ring's sector from -phi to phi on the plane z_face
  axis = newp; Point(axis) = {0, 0, z_face};
  a = newp;
  Point(a)     = {pad_inner*Cos(phi), -pad_inner*Sin(phi), z_face};
  Point(a + 1) = {pad_outer*Cos(phi), -pad_outer*Sin(phi), z_face};
  Point(a + 2) = {pad_outer*Cos(phi), pad_outer*Sin(phi), z_face};
  Point(a + 3) = {pad_inner*Cos(phi), pad_inner*Sin(phi), z_face};
  c = newl;
  Line(c) = {a, a + 1}; Circle(c + 1) = {a + 1, axis, a + 2};
  Line(c + 2) = {a + 2, a + 3}; Circle(c + 3) = {a + 3, axis, a};
  l[] = {c, c+1, c+2, c+3}; n_1 = n_radial; n_2 = n_pad;
  Call Quadrilateral;
  base = f;
Return

Function Pad // behind the plane z_face, towards up = 1 or -1
  phi = lining_end;
  Call Sector;
  face[] = {base};
  e[] = Extrude {0, 0, up*lining} { Surface{base}; Layers{1}; Recombine; };
  linings[] = {e[1]}; lining_back[] = {e[0]};
  z_face += up*lining; phi = plate_end;
  Call Sector;
  plate_front[] = {base};
  e[] = Extrude {0, 0, up*plate} { Surface{base}; Layers{1}; Recombine; };
  plates[] = {e[1]}; right[] = {e[2]}; left[] = {e[4]}; // ends at y < 0 and y > 0
  g[] = Extrude {0, 0, up*shim} { Surface{e[0]}; Layers{1}; Recombine; };
  shims[] = {g[1]}; shim_back[] = {g[0]};
Return

z_face = h/2; up = 1; Call Pad;
Physical Volume("outer lining") = linings[];
Physical Volume("outer plate") = plates[];
Physical Volume("outer shim") = shims[];
Physical Surface("outer face") = face[];
Physical Surface("outer lining back") = lining_back[];
Physical Surface("outer plate front") = plate_front[];
Physical Surface("outer right end") = right[];
Physical Surface("outer left end") = left[];
Physical Surface("outer shim back") = shim_back[];

z_face = -h/2; up = -1; Call Pad;
Physical Volume("inner lining") = linings[];
Physical Volume("inner plate") = plates[];
Physical Volume("inner shim") = shims[];
Physical Surface("inner face") = face[];
Physical Surface("inner lining back") = lining_back[];
Physical Surface("inner plate front") = plate_front[];
Physical Surface("inner right end") = right[];
Physical Surface("inner left end") = left[];
Physical Surface("inner shim back") = shim_back[];

Physical Volume("disc") = rotor[];
Physical Surface("hub") = hub[];
Physical Surface("disc top") = top[];
Physical Surface("disc bottom") = bottom[];

// ---- the piston: a cup that is open towards the pad; a square, four blocks to the cup's hollow, four of its wall
centre = newp; Point(centre) = {pad_mid, 0, piston_z};
a = newp;
For k In {0:3}
  u = Cos(Pi/4 + k*Pi/2); v = Sin(Pi/4 + k*Pi/2);
  Point(a + k)     = {pad_mid + 0.5*cup_r*u, 0.5*cup_r*v, piston_z};
  Point(a + 4 + k) = {pad_mid + cup_r*u, cup_r*v, piston_z};
  Point(a + 8 + k) = {pad_mid + piston_r*u, piston_r*v, piston_z};
EndFor
c = newl;
For k In {0:3}
  m = (k + 1) % 4;
  Line(c + k) = {a + k, a + m};
  Circle(c + 4 + k) = {a + 4 + k, centre, a + 4 + m};
  Circle(c + 8 + k) = {a + 8 + k, centre, a + 8 + m};
  Line(c + 12 + k) = {a + k, a + 4 + k};
  Line(c + 16 + k) = {a + 4 + k, a + 8 + k};
EndFor
l[] = {c, c+1, c+2, c+3}; n_1 = 3; n_2 = 3;
Call Quadrilateral; // Gmsh does not come back to the rest of this line
piston_back[] = {f};
For ring In {0:1}
  For k In {0:3}
    m = (k + 1) % 4;
    l[] = {c + 4*ring + k, c + 12 + 4*ring + m, -(c + 4*ring + 4 + k), -(c + 12 + 4*ring + k)};
    n_1 = 3; n_2 = 1;
    Call Quadrilateral;
    piston_back[] += f;
  EndFor
EndFor
piston[] = {}; rim[] = {};
For i In {0:#piston_back[]-1}
  e[] = Extrude {0, 0, cup} { Surface{piston_back[i]}; Layers{1}; Recombine; };
  piston[] += e[1];
  If (i >= 5)
    g[] = Extrude {0, 0, -back - piston_z - cup} { Surface{e[0]}; Layers{2}; Recombine; };
    piston[] += g[1]; rim[] += g[0];
  EndIf
EndFor
Physical Volume("piston") = piston[];
Physical Surface("piston back") = piston_back[];
Physical Surface("piston rim") = rim[];

// ---- caliper and bracket: solids of OpenCASCADE
SetFactory("OpenCASCADE");
Function Boundaries // of the volume solid: those whose box lies in [low[], high[]] are picked
  faces[] = Boundary{ Volume{solid}; };
  picked[] = {};
  For i In {0:#faces[]-1}
    b[] = BoundingBox Surface{ Abs(faces[i]) };
    inside = 1;
    For k In {0:2}
      If (b[k] < low[k] - 0.01 || b[k + 3] > high[k] + 0.01)
        inside = 0;
      EndIf
    EndFor
    If (inside)
      picked[] += Abs(faces[i]);
    EndIf
  EndFor
Return

far = 1000;
c = newv; Box(c) = {84, -42, housing_z, 78, 84, -back - 1 - housing_z}; solids[] = {c}; // the housing
c = newv; Box(c) = {146, -42, housing_z, 16, 84, back + finger - housing_z}; solids[] += c; // the bridge
For side In {0:1} // two fingers, each with a raised face for the pad
  c = newv; Box(c) = {94, side == 0 ? -38 : 10, back + 4, 68, 28, finger - 4}; solids[] += c;
  c = newv; Box(c) = {94, side == 0 ? -38 : 10, back, 36, 28, 6}; solids[] += c;
EndFor
bore = newv; Cylinder(bore) = {pad_mid, 0, bore_z, 0, 0, -bore_z, piston_r + 0.3};
parts[] = BooleanUnion{ Volume{solids[0]}; Delete; }{ Volume{solids[{1:5}]}; Delete; };
parts[] = BooleanDifference{ Volume{parts[]}; Delete; }{ Volume{bore}; Delete; };
caliper = parts[0];
Physical Volume("caliper") = caliper;
solid = caliper;
low[] = {-far, -far, bore_z}; high[] = {far, far, bore_z};
Call Boundaries;
Physical Surface("bore bottom") = picked[];
low[] = {-far, -far, back}; high[] = {far, far, back};
Call Boundaries;
Physical Surface("fingers") = picked[];
low[] = {-far, -42, -far}; high[] = {far, -42, far};
Call Boundaries;
Physical Surface("caliper right") = picked[];
low[] = {-far, 42, -far}; high[] = {far, 42, far};
Call Boundaries;
Physical Surface("caliper left") = picked[];

// Two blocks across the disc's edge, each with two raised rails for the plates' ends, a bar between them, feet for two bolts
rail_end = 32*Pi/180; bracket_end = 42*Pi/180; b_outer = 158;
Function Arc // a ring's sector of the angle phi from phi_0 on, between r_1 and r_2, z_1 and z_2
  v = newv; Cylinder(v) = {0, 0, z_1, 0, 0, z_2 - z_1, r_2, phi};
  w = newv; Cylinder(w) = {0, 0, z_1, 0, 0, z_2 - z_1, r_1, phi};
  arc[] = BooleanDifference{ Volume{v}; Delete; }{ Volume{w}; Delete; };
  Rotate {{0, 0, 1}, {0, 0, 0}, phi_0} { Volume{arc[]}; }
  solids[] += arc[];
Return
solids[] = {};
r_1 = 60; r_2 = 82; z_1 = -43; z_2 = -30; phi = 2*bracket_end; phi_0 = -bracket_end;
Call Arc;
For side In {0:1}
  r_1 = 76; r_2 = b_outer; z_1 = -50; z_2 = back + 4; phi = bracket_end - rail_end;
  phi_0 = side == 0 ? rail_end : -bracket_end;
  Call Arc;
  For half In {0:1}
    r_1 = pad_inner - 2; r_2 = pad_outer + 2; phi = rail_end - plate_end + 1*Pi/180;
    phi_0 = side == 0 ? plate_end : -plate_end - phi;
    z_1 = half == 0 ? 0.5 - back : h/2 + lining - 1.5;
    z_2 = half == 0 ? 1.5 - h/2 - lining : back - 0.5;
    Call Arc;
  EndFor
  r_1 = 62; r_2 = 82; z_1 = -58; z_2 = -38; phi = 8*Pi/180; phi_0 = side == 0 ? 33*Pi/180 : -41*Pi/180;
  Call Arc;
EndFor
parts[] = BooleanUnion{ Volume{solids[0]}; Delete; }{ Volume{solids[{1:8}]}; Delete; };
v = newv; Cylinder(v) = {0, 0, -h/2 - 3, 0, 0, h + 6, r_outer + 4}; // room for the disc
parts[] = BooleanDifference{ Volume{parts[]}; Delete; }{ Volume{v}; Delete; };
bracket = parts[0];
Physical Volume("bracket") = bracket;
solid = bracket;
low[] = {-far, -far, -58}; high[] = {far, far, -58};
Call Boundaries;
Physical Surface("bracket bolts") = picked[];
Function Rail // of the bracket, at y > 0 (sign = 1) or y < 0, between low_z and high_z
  y_1 = sign*pad_inner*0.9*Sin(plate_end); y_2 = sign*b_outer*Sin(plate_end);
  low[] = {pad_inner*0.9*Cos(plate_end), sign > 0 ? y_1 : y_2, low_z};
  high[] = {b_outer*Cos(plate_end), sign > 0 ? y_2 : y_1, high_z};
  Call Boundaries;
Return
low_z = -back; high_z = 0; sign = 1; Call Rail;
Physical Surface("inner left rail") = picked[];
sign = -1; Call Rail;
Physical Surface("inner right rail") = picked[];
low_z = 0; high_z = back; sign = 1; Call Rail;
Physical Surface("outer left rail") = picked[];
sign = -1; Call Rail;
Physical Surface("outer right rail") = picked[];
low[] = {0, 0, -50}; high[] = {far, far, -50};
Call Boundaries;
Physical Surface("bracket left") = picked[];
low[] = {0, -far, -50}; high[] = {far, 0, -50};
Call Boundaries;
Physical Surface("bracket right") = picked[];

Mesh.ElementOrder = order;
Mesh.MshFileVersion = 4.1;
Mesh.MeshSizeMax = size;
