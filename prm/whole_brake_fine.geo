// The brake of whole_brake.geo with caliper and bracket at an engineer's resolution: quadratic tetrahedra of 4.5 mm.
//   gmsh -3 prm/whole_brake_fine.geo -o prm/whole_brake_fine.msh
size = 4.5;
order = 2;
Include "whole_brake.geo";
