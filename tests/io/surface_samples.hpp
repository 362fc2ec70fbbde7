#pragma once

#include <string>

namespace hexopt::test {

inline const std::string kAsciiStl = R"(solid bottom part
 facet normal 0 0 -1
  outer loop
   vertex 0 0 0
   vertex 0 1.5 0
   vertex 1 0 0
  endloop
 endfacet
endsolid bottom part
solid side
 facet normal 0 -1 0
  outer loop
   vertex 0 0 0
   vertex 1e0 0 0
   vertex -0 -0 2
  endloop
 endfacet
 FACET NORMAL 0 -1 0
  OUTER LOOP
   VERTEX 1 0 0
   VERTEX 1 0 2
   VERTEX 0 0 2
  ENDLOOP
 ENDFACET
endsolid
)";

inline const std::string kObj = R"(# comment
mtllib a.mtl
v 0 0 0
v 1 0 0 1.0
v 1 1 0
v 0 1 0 # trailing
vn 0 0 1
vt 0 0
g first group
f 1/1/1 2/1/1 3/1/1 4/1/1
g second
f -4//1 -3//1 \
  -1//1
)";

inline const std::string kOff = R"(# comment
COFF
# counts
4 2 0
0 0 0 255 0 0
1 0 0

1 1 0
0 1 0 # four
4 0 1 2 3  1 0 0
3 0 1 3
)";

inline const std::string kPly = R"(ply
format ascii 1.0
comment none
element vertex 4
property float x
property float y
property double z
property uchar red
element face 2
property list uchar int vertex_indices
property float quality
element edge 1
property int vertex1
property int vertex2
end_header
0 0 0 255
1 0 0 255
1 1 0 255
0 1 0 255
4 0 1 2 3 0.5
3 0 1 3 0.5
0 1
)";

inline const std::string kVtp = R"(<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
<PolyData>
<Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="2">
<CellData><DataArray type="Int32" Name="patch" format="ascii">5 8</DataArray></CellData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>
<Polys>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 6</DataArray>
</Polys>
</Piece>
</PolyData>
</VTKFile>
)";

} // namespace hexopt::test
