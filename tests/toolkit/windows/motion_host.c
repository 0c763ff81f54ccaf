/* A host in C99 that reads files, estimates the motion from the first to the second, and saves it.
   usage: motion_host PRESET FIELD.nrrd FIXED MOVING   the field is written; its summary is printed as JSON
          motion_host FILE...                          prints for each file the sentence why it can not be read, or "read" */
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int fail(const char* doing) {
  fprintf(stderr, "motion_host: %s: %s\n", doing, pal_last_error());
  return 1;
}

/* The frames of a file, one after the other; NULL: it can not be read. */
static float* read_frames(const char* path, PalSequenceSummary* summary) {
  const PalSequenceInfo info = {.size = sizeof info, .paths = &path, .path_count = 1};
  PalSequence* sequence = NULL;
  if (pal_sequence_open(&info, &sequence) != PAL_OK) return NULL;
  summary->size = sizeof *summary;
  float* samples = NULL;
  if (pal_sequence_summary(sequence, summary) == PAL_OK) {
    const size_t count = (size_t)summary->grid.size[0] * summary->grid.size[1] * summary->grid.size[2];
    samples = malloc(count * summary->frame_count * sizeof *samples);
    for (uint32_t k = 0; samples && k < summary->frame_count; ++k)
      if (pal_sequence_frame(sequence, k, samples + k * count, NULL) != PAL_OK) {
        free(samples);
        samples = NULL;
      }
  }
  pal_sequence_close(&sequence);
  return samples;
}

static int estimate(const char* preset, const char* field, char** frames) {
  const PalContextInfo context_info = {.size = sizeof context_info, .version = PAL_VERSION};
  PalContext* context = NULL;
  if (pal_context_open(&context_info, &context) != PAL_OK) return fail("opening palpate");
  PalEstimator* estimator = NULL;
  for (int k = 0; k < 2; ++k) {
    PalSequenceSummary summary;
    float* samples = read_frames(frames[k], &summary);
    if (!samples) return fail("reading a frame");
    const PalEstimatorInfo info = {.size = sizeof info, .grid = summary.grid, .preset = preset};
    if (!estimator && pal_estimator_open(context, &info, &estimator) != PAL_OK) return fail("beginning");
    if (pal_estimator_push(estimator, PAL_FLOAT32, samples, k) != PAL_OK) return fail("giving a frame");
    free(samples);
  }
  PalMotion* motion = NULL;
  PalMotionSummary summary = {.size = sizeof summary};
  const PalFieldInfo first = {.size = sizeof first};
  if (pal_estimator_finish(estimator, &motion) != PAL_OK) return fail("estimating");
  if (pal_motion_summary(motion, &summary) != PAL_OK || pal_motion_save(motion, &first, field) != PAL_OK) return fail("saving");
  printf("{\"device\": \"%s\", \"trust\": \"%s\", \"folded\": %g, \"seconds\": %g, \"mean_mm\": %g}\n", pal_context_device(context),
         summary.trust_word, summary.folded_voxels, summary.seconds, summary.motion_mean_mm);
  pal_motion_close(&motion);
  pal_estimator_close(&estimator);
  pal_context_close(&context);
  return 0;
}

int main(int argc, char** argv) {
  if (argc == 5 && (strcmp(argv[1], "fast") == 0 || strcmp(argv[1], "balanced") == 0)) return estimate(argv[1], argv[2], argv + 3);
  for (int k = 1; k < argc; ++k) {
    PalSequenceSummary summary;
    float* samples = read_frames(argv[k], &summary);
    printf("%s\n", samples ? "read" : pal_last_error());
    free(samples);
  }
  return argc > 1 ? 0 : 2;
}
