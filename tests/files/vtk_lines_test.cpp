// Lines for ParaView and 3D Slicer: compared with text written by hand, and read by VTK's own
// reader if it is installed.
#include "integration/files/vtk_lines.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/files/temporary_folder.h"

#ifdef PALPATE_WITH_VTK
#include <vtkCellData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#endif

namespace palpate::files {
namespace {

VtkLines two_lines() {
  VtkLines lines;
  lines.title = "two";
  lines.points_mm = {{1.0, 2.0, 3.0}, {-1.5, 1e-3, 123456.789}, {0, 0, 0}, {4, 5, 6}, {7, 8, 9}};
  lines.lines = {{0, 1}, {2, 3, 4}};
  lines.of_points = {{"length", 1, {1, 2, 3, 4, 5}},
                     {"moved", 3, {1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 5, 0, -5}}};
  lines.of_lines = {{"kept", 1, {0, 1}}};
  return lines;
}

std::string text_of(const std::string& file) {
  std::ifstream stream(file);
  return {(std::istreambuf_iterator<char>(stream)), {}};
}

TEST(VtkLines, AreTheLegacyFormatToTheLetter) {
  const TemporaryFolder folder;
  const std::string file = folder / "lines.vtk";
  VtkLines lines = two_lines();
  lines.points_mm.resize(2);
  lines.lines = {{0, 1}};
  lines.of_points = {{"length", 1, {1, 2.5}}};
  lines.of_lines = {{"kept", 1, {1}}};
  ASSERT_TRUE(write_vtk_lines(file, lines));
  EXPECT_EQ(text_of(file),
            "# vtk DataFile Version 3.0\n"
            "two; SPACE=LPS\n"
            "ASCII\n"
            "DATASET POLYDATA\n"
            "POINTS 2 double\n"
            "1 2 3\n"
            "-1.5 0.001 123456.789\n"
            "LINES 1 3\n"
            "2 0 1\n"
            "CELL_DATA 1\n"
            "FIELD numbers 1\n"
            "kept 1 1 double\n"
            "1\n"
            "POINT_DATA 2\n"
            "FIELD numbers 1\n"
            "length 1 2 double\n"
            "1\n"
            "2.5\n");
}

TEST(VtkLines, AreWrittenWholeOrNotAtAllAndOnlyUnderTheirOwnEnding) {
  const TemporaryFolder folder;
  const Status wrong = write_vtk_lines(folder / "lines.vtp", two_lines());
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().kind, ErrorKind::kBadOutput);
  EXPECT_NE(wrong.error().message.find(".vtk"), std::string::npos);
  EXPECT_FALSE(check_can_write_vtk(folder / "nowhere/lines.vtk"));
  EXPECT_TRUE(check_can_write_vtk(folder / "lines.VTK"));
  EXPECT_FALSE(std::filesystem::exists(folder / "lines.VTK"));
}

TEST(VtkLines, AreReadByVtk) {
#ifndef PALPATE_WITH_VTK
  GTEST_SKIP() << "VTK's reader is not installed (Debian: libvtk9-dev)";
#else
  const TemporaryFolder folder;
  for (const bool empty : {false, true}) {
    VtkLines lines = two_lines();
    if (empty) lines = {"none", {}, {}, {{"length", 1, {}}}, {}};
    const std::string file = folder / "lines.vtk";
    ASSERT_TRUE(write_vtk_lines(file, lines));
    vtkNew<vtkPolyDataReader> reader;
    reader->SetFileName(file.c_str());
    reader->Update();
    vtkPolyData* read = reader->GetOutput();
    ASSERT_EQ(reader->GetErrorCode(), 0u);
    ASSERT_EQ(size_t(read->GetNumberOfPoints()), lines.points_mm.size());
    ASSERT_EQ(size_t(read->GetNumberOfLines()), lines.lines.size());
    for (size_t p = 0; p < lines.points_mm.size(); ++p)
      for (int a = 0; a < 3; ++a)
        EXPECT_DOUBLE_EQ(read->GetPoint(vtkIdType(p))[a], lines.points_mm[p][a]);
    for (size_t l = 0; l < lines.lines.size(); ++l) {
      vtkNew<vtkIdList> ids;
      read->GetCellPoints(vtkIdType(l), ids);
      ASSERT_EQ(size_t(ids->GetNumberOfIds()), lines.lines[l].size());
      for (size_t k = 0; k < lines.lines[l].size(); ++k)
        EXPECT_EQ(size_t(ids->GetId(vtkIdType(k))), lines.lines[l][k]);
    }
    if (empty) continue;
    EXPECT_EQ(read->GetPointData()->GetArray("moved")->GetNumberOfComponents(), 3);
    EXPECT_EQ(read->GetPointData()->GetArray("moved")->GetComponent(4, 2), -5.0);
    EXPECT_EQ(read->GetPointData()->GetArray("length")->GetComponent(3, 0), 4.0);
    EXPECT_EQ(read->GetCellData()->GetArray("kept")->GetComponent(1, 0), 1.0);
    EXPECT_STREQ(reader->GetHeader(), "two; SPACE=LPS");
  }
#endif
}

}  // namespace
}  // namespace palpate::files
