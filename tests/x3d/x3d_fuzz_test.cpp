// Thousands of damaged scenes from a fixed seed: none may crash, hang or give an invalid result.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "integration/x3d/x3d_file.h"
#include "tests/support/mutator.h"
#include "tests/x3d/fuzz/parse_x3d.h"

namespace palpate::x3d {
namespace {

TEST(X3dFuzz, ReaderHolds) {
  std::ostringstream example;
  example << std::ifstream(PALPATE_SOURCE_DIR "/docs/examples/dichloroethane.x3d").rdbuf();
  ASSERT_FALSE(example.str().empty());
  test::Mutator mutator({"nan",
                         "-1",
                         "0",
                         "1e308",
                         "1e-308",
                         "99999999999999999999",
                         "'",
                         "\"",
                         "<",
                         ">",
                         "/>",
                         "&a;",
                         "<!ENTITY a 'x'>",
                         "<Group DEF='A'>",
                         "</Group>",
                         "USE='v'",
                         "DEF='v'",
                         "TRUE",
                         " ",
                         ",",
                         "<Transform scale='1 2 3'>",
                         "</Transform>",
                         "\xff",
                         "-"});
  for (const std::string& seed :
       {example.str(),
        std::string(
            "<X3D><Scene><Transform DEF='A' scale='1 2 1' center='1 0 0'><VolumeData DEF='v' "
            "dimensions='1 1 1'><ComposedVolumeStyle><OpacityMapVolumeStyle><PixelTexture "
            "image='2 1 4 0 0xFF8040FF'/></OpacityMapVolumeStyle></ComposedVolumeStyle>"
            "<PalpateSequenceTexture3D DEF='s' url='\"a\" \"b\"'/>"
            "</VolumeData><VolumeData><ImageTexture3D url='c'><RawImageLoader width='4' height='3' "
            "pixelType='VEC3' bitsPerPixel='96' pixelComponentType='RATIONAL' pixelSize='1 1 "
            "1'/></ImageTexture3D>"
            "</VolumeData><Shape><StreamTubes><VolumeData "
            "USE='v'/></StreamTubes></Shape><PalpateSurfaceMode><VolumeData "
            "USE='v'/><PiecewiseFunction "
            "segments='0 1 2 3'/></PalpateSurfaceMode></Transform><TimeSensor DEF='t'/>"
            "<PositionInterpolator DEF='p' key='0 1' keyValue='0 0 0 1 1 1'/><ROUTE "
            "fromNode='t' fromField='fraction_changed' toNode='p' toField='set_fraction'/>"
            "<ROUTE fromNode='p' fromField='value_changed' toNode='A' "
            "toField='set_translation'/><ROUTE fromNode='t' fromField='fraction_changed' "
            "toNode='s' toField='set_fraction'/></Scene></X3D>")}) {
    int accepted = 0;
    mutator.run(seed, 4000, [&](std::string_view bytes) {
      fuzz::parse_x3d_file(bytes);
      accepted += bool(parse_x3d("folder/fuzz.x3d", bytes));
    });
    // Enough of them must pass the XML parser.
    EXPECT_GT(accepted, 100);
    EXPECT_LT(accepted, 3900);
  }
}

}  // namespace
}  // namespace palpate::x3d
