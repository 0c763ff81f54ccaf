#pragma once

namespace palpate::app {

/// elastix: multi-resolution B-splines of 10 mm driven by normalised correlation, adaptive
/// stochastic gradient descent.
inline constexpr const char* kElastixParameters = R"((FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(FixedImageDimension 3)
(MovingImageDimension 3)
(UseDirectionCosines "true")
(Registration "MultiResolutionRegistration")
(Interpolator "LinearInterpolator")
(ResampleInterpolator "FinalBSplineInterpolator")
(FinalBSplineInterpolationOrder 1)
(Resampler "DefaultResampler")
(FixedImagePyramid "FixedSmoothingImagePyramid")
(MovingImagePyramid "MovingSmoothingImagePyramid")
(Optimizer "AdaptiveStochasticGradientDescent")
(Transform "BSplineTransform")
(Metric "AdvancedNormalizedCorrelation")
(NumberOfResolutions 4)
(FinalGridSpacingInPhysicalUnits 10.0)
(MaximumNumberOfIterations 500)
(NumberOfSpatialSamples 4000)
(NewSamplesEveryIteration "true")
(ImageSampler "RandomCoordinate")
(HowToCombineTransforms "Compose")
(AutomaticTransformInitialization "false")
(WriteResultImage "false")
(ResultImagePixelType "float")
(ResultImageFormat "mha")
)";

/// plastimatch: three stages of B-splines, mean square. {}: fixed, moving, field.
inline constexpr const char* kPlastimatchCommands = R"([GLOBAL]
fixed={}
moving={}
vf_out={}

[STAGE]
xform=bspline
optim=lbfgsb
metric=mse
threading=openmp
max_its=40
grid_spac=30 30 30
res=4 4 2

[STAGE]
max_its=40
grid_spac=15 15 15
res=2 2 1

[STAGE]
max_its=40
grid_spac=8 8 8
res=1 1 1
)";

}  // namespace palpate::app
