"""Volumes and displacements between 3D Slicer and palpate, without MRML: Slicer's axes are R, A, S, palpate's L, P, S."""

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

LPS_FROM_RAS = np.diag((-1.0, -1.0, 1.0))  # and RAS from LPS


def lps_image(image, ras_from_ijk):
    """A volume of Slicer as palpate takes it: `image` (vtkImageData, whose own geometry is not used) with the places of `ras_from_ijk`
    (vtkMatrix4x4, mm), on the axes L, P, S. It shares the samples."""
    matrix = np.array([[ras_from_ijk.GetElement(row, column) for column in range(4)] for row in range(3)])
    axes = LPS_FROM_RAS @ matrix[:, :3]
    spacing = np.linalg.norm(axes, axis=0)
    result = vtkImageData()
    result.ShallowCopy(image)
    result.SetSpacing(spacing)
    result.SetOrigin(LPS_FROM_RAS @ matrix[:, 3])
    result.SetDirectionMatrix((axes / spacing).reshape(-1).tolist())
    return result


def displacement_grid(u, image):
    """A field as a vtkOrientedGridTransform of Slicer has it: returns its displacement grid (vtkImageData, vectors in mm along R, A, S as scalars) and
    its direction matrix (vtkMatrix4x4). The transform takes a point to where its material goes: it is one to the parent.

    u: shape (z, y, x, 3), mm along L, P, S; image: what lps_image() gave for the frame on which it is."""
    origin, direction, extent = [0.0, 0.0, 0.0], vtkMatrix4x4(), image.GetExtent()
    image.TransformIndexToPhysicalPoint(extent[::2], origin)
    axes = image.GetDirectionMatrix()
    axes = LPS_FROM_RAS @ [[axes.GetElement(row, column) for column in range(3)] for row in range(3)]
    for row in range(3):
        for column in range(3):
            direction.SetElement(row, column, axes[row, column])
    grid = vtkImageData()
    grid.SetDimensions(image.GetDimensions())
    grid.SetSpacing(image.GetSpacing())
    grid.SetOrigin(LPS_FROM_RAS @ origin)
    vectors = numpy_to_vtk((np.reshape(u, (-1, 3)) @ LPS_FROM_RAS).astype(np.float32), deep=True)
    vectors.SetName("displacement")
    grid.GetPointData().SetScalars(vectors)
    return grid, direction
