/* palpate.h: palpate in other programs. C99, and C++.

   A person puts a hand into a moving volume: palpate estimates how the data move, renders the
   forces, and draws the picture. This header gives all of that as functions on opaque handles:

   - PalContext: the device that computes, palpate's own or the host's Vulkan device.
   - PalSequence: frames from files, in any form that palpate reads.
   - PalEstimator: takes frames and estimates their motion; PalMotion: the motion that it found.
   - PalScene: what there is to feel and see.
   - PalSession: a scene that is felt, in a haptic thread of palpate's or in the host's haptic loop.
   - PalView: pictures of a session, into the host's images or into memory.

   Rules

   - Every structure begins with its size: set it to sizeof, and all fields that are not needed to
     0. A program that was compiled with an older header continues to work: fields that its
     structures lack are taken as 0. A size larger than the library knows gives PAL_BAD_VERSION, for
     every structure. A structure that can grow is never part of another one, which points to it
     instead. (PalGrid, PalReading, PalTick and PalEye have no size: they never change.)
   - Flags that this header does not name are 0, and numbers are in the range that is given with
     them: others give PAL_BAD_INPUT, with a sentence that names the value and the range.
   - Functions return a PalResult: 0 is success, below 0 is a failure, above 0 is "not yet" or "no
     more". After a failure pal_last_error() gives a sentence for people, separate for each thread.
   - A function that closes takes the handle's address and sets the handle to NULL. Closing NULL is
     no error. A call with NULL, or with a handle that another thread has closed, fails with
     PAL_BAD_INPUT; closing waits for calls that are running.
   - Callbacks get the `user` pointer that was given with them. They are called without a lock of
     the library held, and may call every function except those that close, stop or finish the
     object that calls them.
   - A callback should not throw. A callback in C++ may do so all the same: the library catches the
     exception and reports it in a sentence. By callback:
       on_progress   the estimation is cancelled; pal_estimator_finish() reports the exception
       exchange      counts as a fault of the device: the force goes to zero by a ramp, and an event
                     of kind PAL_EVENT_NOTE reports the exception
       on_event, unlock_queue   the context's log reports it
       lock_queue    nothing is submitted; the call that needed the queue fails with
                     PAL_DEVICE_FAILED
       a mode        is left out, and an event of kind PAL_EVENT_NOTE reports it
       log           the exception is dropped
   - The library never exits, aborts, prints or throws to its caller, and sets neither the locale
     nor a signal handler.
   - Memory comes from the C++ runtime's allocator; there is no hook for it, since parts of that
     runtime allocate on their own.
   - Threads: [RT] may be called on any thread and is real-time safe: no lock, no allocation, no
     system call; [ANY] may be called on any thread.
   - Text is UTF-8, on every system also in names of files.
   - Units: haptics m, N, s in the device's space (x right, y up, z towards the user); the world is
     m, right-handed, y up; grids and motion fields are mm in the patient's space (LPS), as ITK has
     them. A volume's own space is m, y up: x = L, y = S, z = -P of its patient, times 0.001. */
#ifndef PALPATE_H
#define PALPATE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define PAL_API
#else
#define PAL_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- version, results, grids ---- */

#define PAL_VERSION_MAJOR 0
#define PAL_VERSION_MINOR 1
#define PAL_VERSION_PATCH 0
#define PAL_VERSION \
  (((uint32_t)PAL_VERSION_MAJOR << 16) | (PAL_VERSION_MINOR << 8) | PAL_VERSION_PATCH)

/* The library's version, packed as PAL_VERSION, which is this header's. [RT] */
PAL_API uint32_t pal_version(void);

typedef enum PalResult {
  PAL_OK = 0,
  PAL_NOT_YET = 1,        /* no failure: call again later */
  PAL_END = 2,            /* the index is beyond the end of the list */
  PAL_BAD_INPUT = -1,     /* data or arguments are wrong: the sentence says what to change */
  PAL_BAD_OUTPUT = -2,    /* a result could not be written: nothing was touched */
  PAL_NO_DEVICE = -3,     /* no device that can do the work */
  PAL_DEVICE_FAILED = -4, /* the device was lost, or its driver refused */
  PAL_OUT_OF_MEMORY = -5, /* the host or the device can not hold the work */
  PAL_CANCELLED = -6,     /* on request */
  PAL_BAD_VERSION = -7,   /* the header's and the library's versions do not match */
  PAL_INTERNAL = -8       /* a fault of the library's own: please report it */
} PalResult;

/* The name of a result, such as "PAL_BAD_INPUT"; a static string. [RT] */
PAL_API const char* pal_result_name(PalResult result);

/* A sentence about this thread's last failure, "" before the first; valid until this thread's next
   call of any function. [ANY] */
PAL_API const char* pal_last_error(void);

/* Positions of samples: sample (i, j, k) is element i + size[0] * (j + size[1] * k) of an array;
   its centre is at origin + direction * (spacing * (i, j, k)). */
typedef struct PalGrid {
  uint32_t size[3];
  double spacing_mm[3]; /* more than 0 */
  double origin_mm[3];  /* LPS */
  /* Three rows of a rotation matrix, whose columns are the directions of i, j, k in LPS; all 0: the
     identity matrix. */
  double direction[9];
} PalGrid;

typedef enum PalSampleType {
  PAL_FLOAT32 = 0,
  PAL_FLOAT64 = 1,
  PAL_INT8 = 2,
  PAL_UINT8 = 3,
  PAL_INT16 = 4,
  PAL_UINT16 = 5,
  PAL_INT32 = 6,
  PAL_UINT32 = 7,
  PAL_SAMPLE_TYPE_MAX = 0x7fffffff /* not a type: any number fits, wrong ones are refused */
} PalSampleType;

/* ---- contexts ---- */

typedef struct PalContext PalContext;

enum {
  /* Use no device that computes: forces only, and motion is not estimated. */
  PAL_CONTEXT_NO_GPU = 1u << 0
};

/* A host's Vulkan device, which the library shares. It must have been created with Vulkan 1.2 or
   later and with the feature shaderStorageImageWriteWithoutFormat. The queue must support compute;
   for pictures in the host's images it must be the queue on which the host draws them. The device
   must outlive the context. Handles are Vulkan's own. */
typedef struct PalVulkan {
  uint32_t size; /* sizeof(PalVulkan) */
  uint32_t queue_family;
  void* instance;        /* VkInstance */
  void* physical_device; /* VkPhysicalDevice */
  void* device;          /* VkDevice */
  void* queue;           /* VkQueue */
  /* 1: created with the feature shaderStorageImageExtendedFormats, which saves memory. */
  uint32_t has_extended_formats;
  /* Called before and after every use of the queue, on any thread; NULL: only the library uses the
     queue while the context is open. */
  void (*lock_queue)(void* user);
  void (*unlock_queue)(void* user);
  void* user;
} PalVulkan;

typedef struct PalContextInfo {
  uint32_t size;    /* sizeof(PalContextInfo) */
  uint32_t version; /* PAL_VERSION */
  uint32_t flags;   /* PAL_CONTEXT_... */
  /* A Vulkan device, by number or part of its name; NULL: the first GPU, else the CPU. */
  const char* device;
  /* The host's device, used instead of `device`; NULL: the library opens a device of its own. */
  const PalVulkan* vulkan;
  uint64_t memory_cap_bytes; /* largest use of device memory, from 10,000; 0: all there is */
  /* Called with sentences about what the library does, on any thread; NULL: not called. */
  void (*log)(void* user, const char* sentence);
  void* user;
} PalContextInfo;

/* Opens a context. PAL_NO_DEVICE: there is no such device, or it can not do the work. [ANY] */
PAL_API PalResult pal_context_open(const PalContextInfo* info, PalContext** context);
/* Closes a context. Objects that were opened with it continue to work; its resources are freed when
   the last of these objects is closed. [ANY] */
PAL_API PalResult pal_context_close(PalContext** context);
/* The name of the context's device, "" if it has none; valid until the context is closed. [ANY] */
PAL_API const char* pal_context_device(const PalContext* context);

/* ---- frames from files ----

   The frames of a sequence in any form that palpate reads, for a program that estimates or shows
   them itself. A scene reads its files on its own. */

typedef struct PalSequence PalSequence;

typedef struct PalSequenceInfo {
  uint32_t size; /* sizeof(PalSequenceInfo) */
  /* A 4D file, a folder (of DICOM or of 3D files; "FOLDER#4": its DICOM series 4, by number or
     name), 3D files in order, or DICOM folders with one frame each. */
  const char* const* paths;
  uint32_t path_count;
  const double* nan_as; /* what samples become that are NaN; NULL: they are refused */
} PalSequenceInfo;

/* Reads the headers of a sequence, whose frames all have one grid; one frame is enough. [ANY] */
PAL_API PalResult pal_sequence_open(const PalSequenceInfo* info, PalSequence** sequence);
/* Closes a sequence. [ANY] */
PAL_API PalResult pal_sequence_close(PalSequence** sequence);

typedef struct PalSequenceSummary {
  uint32_t size;        /* sizeof(PalSequenceSummary), set before the call */
  uint32_t frame_count; /* at least 1 */
  uint32_t has_times;   /* 0: the files do not say when a frame was taken */
  PalGrid grid;         /* of every frame */
  /* What a person should know of the files, a sentence per line; valid until the sequence is
     closed. */
  const char* notes;
} PalSequenceSummary;

/* Gives what the headers say. [ANY] */
PAL_API PalResult pal_sequence_summary(const PalSequence* sequence, PalSequenceSummary* summary);

/* Reads frame `index`: size[0] * size[1] * size[2] floats of the grid, x fastest, rescaled as the
   file says, and the time at which it was taken, s; without times the index. `samples` or `time_s`
   may be NULL. Cheapest in rising order. PAL_END after the last frame. One thread at a time reads,
   others wait. [ANY] */
PAL_API PalResult pal_sequence_frame(PalSequence* sequence, uint32_t index, float* samples,
                                     double* time_s);

/* ---- motion ----

   How the material moves between frames that a program has in memory. A displacement field gives
   u(x) for each sample x of the fixed frame: the material at x in the fixed frame is at x + u(x) in
   the moving frame. u is in mm along L, P, S, as in an ITK displacement field. */

typedef struct PalEstimator PalEstimator;
typedef struct PalMotion PalMotion;

enum {
  /* For three or more frames: estimate only the fields from each frame to the next, not one motion
     for all frames. */
  PAL_ESTIMATOR_PAIRWISE = 1u << 0,
  /* The last frame leads back to the first. */
  PAL_ESTIMATOR_CYCLIC = 1u << 1,
  /* Measure nothing for a verdict, which saves its time. */
  PAL_ESTIMATOR_NO_VERDICT = 1u << 2
};

typedef struct PalEstimatorInfo {
  uint32_t size;      /* sizeof(PalEstimatorInfo) */
  uint32_t flags;     /* PAL_ESTIMATOR_... */
  PalGrid grid;       /* of all frames */
  const char* preset; /* "fast", "balanced", "best" or "classic"; NULL: "balanced" */
  /* One byte per sample of the grid; 0: the sample does not count. NULL: all samples count. Read
     during the call. */
  const uint8_t* mask;
  /* Called on the estimator's threads with the present step and the share of the work that is done,
     0 to 1; NULL: not called. It may call pal_estimator_cancel(). */
  void (*on_progress)(void* user, const char* doing, double share);
  void* user;
  /* At most this many on each pyramid level, to 10,000; 0: as the preset has it. */
  uint32_t iterations;
} PalEstimatorInfo;

/* Opens an estimator. The context must have a device (not PAL_CONTEXT_NO_GPU). [ANY] */
PAL_API PalResult pal_estimator_open(PalContext* context, const PalEstimatorInfo* info,
                                     PalEstimator** estimator);

/* Takes the next frame: size[0] * size[1] * size[2] samples of the grid, x fastest, read during the
   call. If only pairs are wanted (two frames, or PAL_ESTIMATOR_PAIRWISE), work on a pair begins
   when its second frame is pushed. time_s: when the frame was taken, more than the last frame's;
   below 0: one second after the last frame. [ANY] */
PAL_API PalResult pal_estimator_push(PalEstimator* estimator, PalSampleType type,
                                     const void* samples, double time_s);

/* The progress of an estimator. */
typedef struct PalProgress {
  uint32_t size;          /* sizeof(PalProgress), set before the call */
  uint32_t frames_pushed; /* so far */
  uint32_t steps_found;   /* number of fields from a frame to the next that are known */
  uint32_t is_finished;   /* 1: pal_estimator_finish() has given the motion */
  double share;           /* of the work on the frames that were pushed, 0 to 1 */
} PalProgress;

/* Gives the progress; does not wait. For a host that polls it while pal_estimator_finish() waits on
   another thread. [ANY] */
PAL_API PalResult pal_estimator_poll(const PalEstimator* estimator, PalProgress* progress);

/* Ends the input: waits for the motion and gives it. May be called once; PAL_CANCELLED after
   pal_estimator_cancel(). [ANY] */
PAL_API PalResult pal_estimator_finish(PalEstimator* estimator, PalMotion** motion);

/* Stops as soon as the device has finished its present work; after that the estimator can only be
   closed. [ANY], also from on_progress. */
PAL_API PalResult pal_estimator_cancel(PalEstimator* estimator);

/* Closes an estimator; cancels an estimation that is still running. [ANY], but not from
   on_progress. */
PAL_API PalResult pal_estimator_close(PalEstimator** estimator);
/* Closes a motion. [ANY] */
PAL_API PalResult pal_motion_close(PalMotion** motion);

/* Opens one motion for all frames, from the single file that `palpate motion` and pal_motion_save()
   write. Older files do not contain the frames' grid; in its place stands the grid on which the
   motion was solved, which covers the same region with fewer samples, and the functions below mean
   this grid where they say "the frames' grid". For a field or a frame on another grid give that
   grid in PalFieldInfo.grid; pal_motion_warp() then takes its frame to be on it, too. [ANY] */
PAL_API PalResult pal_motion_open(PalContext* context, const char* path, PalMotion** motion);

typedef enum PalTrust {
  PAL_TRUST_UNKNOWN = 0, /* nothing was measured */
  PAL_TRUST_OK = 1,
  PAL_TRUST_SUSPECT = 2, /* a person should check it before it is used */
  PAL_TRUST_FAILED = 3   /* do not use it */
} PalTrust;

/* A motion in numbers, and what was measured to judge it. With several fields the measures of
   quality are those of the worst one. NaN where nothing was measured. */
typedef struct PalMotionSummary {
  uint32_t size; /* sizeof(PalMotionSummary), set before the call */
  uint32_t frame_count;
  uint32_t step_count;      /* number of fields from a frame to the next */
  uint32_t is_whole;        /* 1: one motion for all frames, from a reference frame */
  uint32_t reference_frame; /* that frame, where is_whole */
  uint32_t harmonics;       /* of the Fourier series in time; 0: splines through the frames */
  double cycle_s;           /* length of the cycle; 0: not cyclic */
  PalGrid grid;             /* of the frames */
  PalTrust trust;
  const char* trust_word; /* "ok", "suspect", "failed", or "" */
  /* Why the verdict is not ok, a sentence per line; valid until the motion is closed. */
  const char* reasons;
  double seconds; /* how long the estimation took */
  double motion_mean_mm, motion_max_mm;
  double folded_voxels;                         /* number of voxels at which the field folds */
  double least_determinant;                     /* least det(I + grad u) */
  double correlation_before, correlation_after; /* mean local correlation */
  double motion_left_voxels; /* motion that is still found between the matched frames */
  double drift_mean_mm;      /* after one cycle of the fields from frame to frame */
  double within_95_mm;       /* where there is structure 95 % of the voxels are right within this */
} PalMotionSummary;

/* Gives the summary of a motion. [ANY] */
PAL_API PalResult pal_motion_summary(const PalMotion* motion, PalMotionSummary* summary);

enum {
  /* The field from the reference frame to the time `time_s` (on the frames' time axis), instead of
     from frame `step` to the next. Only if is_whole is 1. */
  PAL_FIELD_TO_TIME = 1u << 0,
  /* The inverse of the field. */
  PAL_FIELD_INVERSE = 1u << 1
};

/* Which field, and at which samples. */
typedef struct PalFieldInfo {
  uint32_t size;       /* sizeof(PalFieldInfo) */
  uint32_t flags;      /* PAL_FIELD_... */
  uint32_t step;       /* from frame `step` to the next; ignored with PAL_FIELD_TO_TIME */
  double time_s;       /* only with PAL_FIELD_TO_TIME */
  const PalGrid* grid; /* NULL: the frames' grid */
} PalFieldInfo;

/* Gives u at the grid's samples: 3 * size[0] * size[1] * size[2] floats, the components x, y, z of
   a sample side by side, mm. [ANY] */
PAL_API PalResult pal_motion_field(const PalMotion* motion, const PalFieldInfo* info,
                                   float* xyz_mm);

/* Gives the confidence of a field at each sample of the grid, one float each, 0 (a guess) to 1: of
   the step, or, if is_whole is 1, of the field from the reference frame to frame `step`. flags and
   time_s are ignored. [ANY] */
PAL_API PalResult pal_motion_confidence(const PalMotion* motion, const PalFieldInfo* info,
                                        float* values);

/* Gives the standard deviation of a field's error at each sample of the grid, two floats side by
   side, mm: along the image gradient, where the images show motion best, and across it, in each of
   the two other directions. Of the field whose confidence pal_motion_confidence() gives; flags and
   time_s are ignored. [ANY] */
PAL_API PalResult pal_motion_deviation(const PalMotion* motion, const PalFieldInfo* info,
                                       float* along_across_mm);

/* Warps a frame with a field: gives at each sample x of the grid the frame's value at x + u(x),
   interpolated linearly, clamped to the border outside. The frame is on the frames' grid. [ANY] */
PAL_API PalResult pal_motion_warp(const PalMotion* motion, const PalFieldInfo* info,
                                  PalSampleType type, const void* samples, float* warped);

/* Writes a field in a format of ITK's displacement fields (.mha, .nrrd, .nii, .nii.gz). info NULL:
   writes the one motion for all frames, as one file (.nrrd) that palpate can read again. After a
   failure there is no partial file. [ANY] */
PAL_API PalResult pal_motion_save(const PalMotion* motion, const PalFieldInfo* info,
                                  const char* path);

/* ---- scenes ----

   What there is to feel and see: volumes with their data, haptic modes, a spring. A scene does not
   change after it was opened. Any number of sessions may use it, also after it was closed. */

typedef struct PalScene PalScene;

/* Frames in memory, used in place of a file. They are read only during the call. */
typedef struct PalFrames {
  uint32_t size; /* sizeof(PalFrames) */
  /* Used in place of a file's name: among the paths of PalSceneInfo, or in a scene's "files". */
  const char* name;
  PalGrid grid; /* of every frame */
  PalSampleType sample_type;
  /* frame_count arrays of size[0] * size[1] * size[2] samples, x fastest. */
  const void* const* frames;
  uint32_t frame_count;
  /* frame_count times in rising order; NULL: as PalSceneInfo.frames_per_second, or if that is
     0 all frames in one second, at most 30 a second. */
  const double* times_s;
  const PalMotion* motion; /* of these frames; NULL: it is estimated while they are felt */
} PalFrames;

enum {
  /* The host may place volumes that nothing else moves, see pal_session_place(). */
  PAL_SCENE_MOVABLE = 1u << 0,
  /* A sequence without a scene file keeps its size. Without this flag it is scaled down to the
     device's workspace when a session opens. */
  PAL_SCENE_TRUE_SIZE = 1u << 1,
  /* The sequence is not cyclic: its last frame does not lead back to its first. */
  PAL_SCENE_NOT_CYCLIC = 1u << 2,
  /* `frames` has one frame, the first of a live source. It is felt as a sequence without a scene
     file. The host gives the later frames to the session, see pal_session_push_frame(). */
  PAL_SCENE_LIVE = 1u << 3,
  /* Motion that is not given is not estimated: the frames are felt as they are. */
  PAL_SCENE_NO_MOTION = 1u << 4,
  /* The known motion of "heart" and "shell" is removed, so that it is estimated like that of
     measured data. */
  PAL_SCENE_FORGET_MOTION = 1u << 5
};

typedef struct PalSceneInfo {
  uint32_t size;  /* sizeof(PalSceneInfo) */
  uint32_t flags; /* PAL_SCENE_... */
  /* A scene file (.json, .x3d), a folder ("FOLDER#4": its DICOM series 4, by number or name), a 4D
     file, files of frames in order, the name of a PalFrames, "heart", "shell", "molecule", or
     "igtl://HOST:PORT": the images of an OpenIGTLink server ("igtl://HOST:PORT?crc=none": also
     messages without a CRC). For a server the call waits for the first image; each session that is
     opened makes a connection of its own and follows the images that arrive. */
  const char* const* paths;
  uint32_t path_count;
  const char* json; /* instead of paths: a scene in the format of docs/scene-file.md */
  /* The folder to which the paths in a scene are relative; NULL: the folder of the scene file; with
     `json` the working folder. */
  const char* folder;
  const PalFrames* frames; /* an array of frame_sets elements */
  uint32_t frame_sets;
  const char* const* mode_libraries; /* haptic modes of your own, see docs/writing-a-mode.md */
  uint32_t mode_library_count;
  /* For a sequence without a scene file: */
  const double* iso_value; /* of the surface to feel; NULL: chosen from the data */
  double strength_n;       /* the largest force of the surface, 0.01 to 1000; 0: 4 */
  double friction;         /* Coulomb's mu, to 10; 0: 0.2; below 0: no friction */
  /* 0.001 to 100,000; 0: as in the data, or where they have no times all frames in one second, at
     most 30 a second */
  double frames_per_second;
  const char* fields; /* folder or file that `palpate motion` wrote; NULL: none */
  /* Also for a sequence without a scene file; each as the program's option of that name. */
  const char* wall; /* "values", "region" or "ridges"; NULL: chosen from the data */
  /* "reference", "mean" or "own"; NULL: chosen from the motion. Also for the volumes of a scene
     that are read from files. */
  const char* values;
  /* The width of the range of values around iso_value over which the strength rises; 0: chosen from
     the data. */
  double width;
  double scale;                /* factor on the size, 1e-4 to 1e4; 0: as the flags require */
  const char* const* segments; /* segmentation_count files; the walls are their segments */
  uint32_t segmentation_count;
  /* The frame to which a single segmentation belongs, to 1,000,000. */
  uint32_t segments_frame;
  const char* const* segment_names; /* names of segment_count segments; NULL: all */
  uint64_t segment_count;
  /* For "igtl://HOST:PORT": */
  const char* image;     /* use the images of this device name; NULL: that of the first image */
  const char* transform; /* the transforms of this device name move the volume; NULL: none */
  double wait_s;         /* how long to wait for the first image, 0.001 to 1e6; 0: 10 */
  /* Further options of the scene, as a JSON object: {"nan_as": 0}. pal_options() lists all of them;
     those that are fields above may stand here too, and then here counts. NULL: none. */
  const char* options;
} PalSceneInfo;

/* Reads the data and prepares them, on all cores; this takes between parts of a second and many
   seconds. PAL_NO_DEVICE if a server's first image does not arrive in time. [ANY] */
PAL_API PalResult pal_scene_open(PalContext* context, const PalSceneInfo* info, PalScene** scene);

/* Closes a scene. Sessions that use it continue. [ANY] */
PAL_API PalResult pal_scene_close(PalScene** scene);

typedef enum PalSceneText {
  PAL_SCENE_TEXT_NOTES = 0,       /* what was chosen, and what was left out, a sentence per line */
  PAL_SCENE_TEXT_PLAN = 1,        /* what each haptic frame does, and what it leaves out and why */
  PAL_SCENE_TEXT_JSON = 2,        /* the scene in the format of docs/scene-file.md */
  PAL_SCENE_TEXT_MAX = 0x7fffffff /* not a text: any number fits, wrong ones are refused */
} PalSceneText;

/* Writes at most `capacity` bytes of a text, with the closing zero byte, to `text` (NULL if
   capacity is 0). *length becomes the length of the whole text without that byte. [ANY] */
PAL_API PalResult pal_scene_text(const PalScene* scene, PalSceneText which, char* text,
                                 size_t capacity, size_t* length);

/* A volume of a scene. */
typedef struct PalVolume {
  uint32_t size; /* sizeof(PalVolume), set before the call */
  uint32_t frame_count;
  double length_s;              /* duration of the sequence at rate 1 */
  double low_m[3], high_m[3];   /* what contains its data, along the axes of volume space */
  double world_from_volume[12]; /* at the start: three rows of four, m */
  uint32_t is_motion_known;     /* 0: it stands still until a session has estimated the motion */
  uint32_t is_movable;          /* 1: the host may place it, see pal_session_place() */
  /* The box that its data fill, along their own axes: a corner, and from there its three edges, x y
     z of each, volume space. The data of most MR of the heart lie obliquely. */
  double corner_m[3], edges_m[9];
} PalVolume;

/* Gives volume `index`; PAL_END after the last one. [ANY] */
PAL_API PalResult pal_scene_volume(const PalScene* scene, uint32_t index, PalVolume* volume);

/* The result of a replay. */
typedef struct PalReplay {
  uint32_t size;       /* sizeof(PalReplay), set before the call */
  uint32_t is_cut_off; /* 1: the recording ends before its session did */
  uint64_t ticks;
  uint64_t different; /* number of ticks whose output differs from the recorded one in any bit */
  int64_t first_different; /* the first of these; below 0: there is none */
} PalReplay;

/* Replays a recording of this scene (PalSessionInfo.recording, `palpate feel --record`), without a
   device, and compares every bit. `tubes`: a file into which all stream tubes that the hand
   released in the recording are written, as by pal_session_save_tubes(); NULL: none. PAL_BAD_INPUT
   if the recording is of another scene, is damaged, or has lost ticks. [ANY] */
PAL_API PalResult pal_scene_replay(const PalScene* scene, const char* recording, const char* tubes,
                                   PalReplay* replay);

/* ---- devices ----

   Haptic units: m, N, s, rad. Device space: x right, y up, z towards the user. */

typedef struct PalDeviceInfo {
  uint32_t size;                /* sizeof(PalDeviceInfo) */
  const char* name;             /* for people; NULL: "host" */
  double max_force_n;           /* peak force in every direction; more than 0 */
  double max_stiffness_n_per_m; /* largest stable stiffness; 0: not known */
  double workspace_centre_m[3];
  double workspace_radius_m; /* more than 0; forces fade out at this radius */
  double resolution_m;       /* of the position; 0: not known */
  double delay_s;            /* from taking a position to its force on the motors; 0: not known */
  /* what its motors hold for ever, N; 0: not stated, and no force is lowered because of their heat
   */
  double continuous_force_n;
  /* the largest torque that it can give, N m; 0: it gives none */
  double max_torque_n_m;
} PalDeviceInfo;

enum {
  PAL_FAULT_NONE = 0,
  PAL_FAULT_NOT_OPENED = 1,
  PAL_FAULT_UNPLUGGED = 2,
  PAL_FAULT_TIMEOUT = 3,
  PAL_FAULT_GARBAGE = 4,
  PAL_FAULT_NOT_HOMED = 5,
  PAL_FAULT_FORCE_OFF = 6
};

typedef struct PalReading {
  double position_m[3]; /* of the grip */
  int64_t time_ns;      /* CLOCK_MONOTONIC when it was taken; 0: now */
  uint32_t buttons;     /* bit k: button k is down */
  uint32_t fault;       /* PAL_FAULT_...; if it is not 0 the position is ignored */
  uint32_t is_fresh;    /* 0: not a new measurement: the position is the last one again */
} PalReading;

enum {
  PAL_GRIP_TURNS = 1u << 0, /* rotation and angular velocity are sensed */
  PAL_GRIP_OPENS = 1u << 1  /* the opening of a gripper is sensed */
};

/* How a grip is held. The pen in pictures and the points of a finger pad (the option tool_points)
   turn with it; nothing else is felt by it. What is not finite, or a rotation that is none, is
   taken as not sensed. */
typedef struct PalGrip {
  uint32_t size;              /* sizeof(PalGrip) */
  uint32_t senses;            /* PAL_GRIP_...; 0: only the position is sensed */
  double device_from_grip[4]; /* a rotation as a unit quaternion w, x, y, z; the grip's own z goes
                                 along its shaft, away from the tip */
  double angular_velocity_rad_per_s[3]; /* along the device's axes */
  double opening_rad;                   /* of the gripper; 0: closed */
} PalGrip;

/* A force device of the host, for sessions with a haptic thread of palpate's. `exchange` is called
   about 1,000 times a second on that thread: it sends a force to the hand (N) and fills in the
   newest reading. It must return within about a millisecond and must not wait for a lock that
   another thread may hold longer. Both structures are copied; `exchange` and `user` must be valid
   until the session is closed. The last force that is sent is zero. */
typedef struct PalDevice {
  uint32_t size; /* sizeof(PalDevice) */
  const PalDeviceInfo* info;
  void (*exchange)(void* user, const double force_n[3], PalReading* reading);
  void* user;
  /* NULL: only the position is sensed. Called after each exchange, under the same conditions, with
     a grip that senses nothing; grip->size is the library's: nothing behind it may be written. */
  void (*grip)(void* user, PalGrip* grip);
  /* NULL: the device gives no torque. Called before each exchange, under the same conditions: the
     torque on the grip about its position (N m, device's axes), at most info->max_torque_n_m, that
     belongs to the force of the exchange. The last one is zero. */
  void (*torque)(void* user, const double torque_n_m[3]);
} PalDevice;

/* ---- sessions ----

   A scene that is felt: haptic frames, poses, playback, and the estimation of missing motion. */

typedef struct PalSession PalSession;

enum {
  /* The host calls pal_haptics_tick() in its own haptic loop; there is no haptic thread. */
  PAL_SESSION_HOST_TICKS = 1u << 0,
  /* Motion that is not given is not estimated: volumes without motion stand still. */
  PAL_SESSION_NO_ESTIMATION = 1u << 1,
  /* The haptic thread does not request real-time priority, locked memory and cores that do not
     sleep. */
  PAL_SESSION_NO_REAL_TIME = 1u << 2,
  /* A button of the device must be held, or the force goes to zero. */
  PAL_SESSION_DEAD_MAN = 1u << 3,
  /* Of a live source every frame is followed, even if the frames repeat. Without this flag frames
     that repeat become a cycle with one motion for all of them, which plays at the pace of the
     arriving frames. */
  PAL_SESSION_FOLLOW = 1u << 4
};

typedef enum PalEventKind {
  PAL_EVENT_NOTE = 0,         /* information for the user */
  PAL_EVENT_MOVES = 1,        /* motion is known, coarse at first: the volumes begin to move */
  PAL_EVENT_WHOLE_MOTION = 2, /* one motion for a whole sequence is felt from now on */
  PAL_EVENT_MOTION_FAILED = 3 /* the sentence says why; motion that is known stays in use */
} PalEventKind;

typedef struct PalSessionInfo {
  uint32_t size;             /* sizeof(PalSessionInfo) */
  uint32_t flags;            /* PAL_SESSION_... */
  const PalDeviceInfo* host; /* with PAL_SESSION_HOST_TICKS: the host's device */
  /* Without that flag: a device of the host's; NULL: palpate drives the device that device_name
     names. */
  const PalDevice* device;
  /* As the program's option --device: "falcon", "haply@localhost:10001"; NULL: the first device
     that answers (a second is allowed for each). "simulated": a simulated hand, see simulated_path.
     "igtl://HOST:PORT": a tracked tool. The transforms of an OpenIGTLink server give the position
     of its tip, in the patient space of the first volume. It gives no force, and the scene's
     transform of the device is ignored. */
  const char* device_name;
  double max_force_n;       /* 0.01 to 100; 0: the scene's */
  double stiffness_n_per_m; /* of the spring between hand and proxy, 1 to 1e5; 0: the scene's */
  /* Ticks further apart than this ramp the force down, 0.001 to 1; 0: 0.005, or 0.05 for a
     simulated hand and a tracked tool. */
  double watchdog_s;
  const char* preset; /* of the estimation; NULL: "balanced", for a live source "fast" */
  /* Called with each event, on the session's threads; must not close the session. NULL: not
     called. */
  void (*on_event)(void* user, PalEventKind kind, const char* sentence);
  void* user;
  /* The file in which every tick is recorded until the session is closed, 1.1 GB per hour. `palpate
     feel SCENE --replay FILE` then gives the same forces bit by bit, if SCENE consists of files.
     The scene's motion must be known at the start: motion that is found later is not part of a
     recording. NULL: nothing is recorded. */
  const char* recording;
  /* Bit k: button k of the device acts as pal_session_ask_tubes(): pressed, it lays a stream tube;
     pressed again within half a second, it keeps the tubes; held for a second, it clears them.
     0: no button does. */
  uint32_t tube_buttons;
  /* A CSV file in which every tick becomes a row, until the session is closed. NULL: none. */
  const char* csv;
  /* The folder into which the ticks around a fault are written; it is created when needed. "off":
     they are not written; NULL: $XDG_STATE_HOME/palpate, or ~/.local/state/palpate. */
  const char* black_box;
  /* The port on which OpenIGTLink clients may connect. Threads of the session send them the
     position of the proxy and the force ten times a second, the moved volume and its motion at most
     twice a second; see docs/openigtlink.md. 0: none. */
  uint64_t serve_port;
  /* For the device "simulated": "press", "tap", "stroke", "circle", "sweep" or a file of
     t_s,x_m,y_m,z_m; NULL: "press". */
  const char* simulated_path;
  const char* simulated_hand; /* "human", "loose", "firm" or "none"; NULL: "human" */
  double lets_go_s;           /* time after which the simulated hand lets go, to 1e6; 0: never */
  /* For the device "igtl://HOST:PORT": use the transforms of this device name; NULL: that of the
     first transform. */
  const char* tool;
  /* Further options of the session, as a JSON object: {"core": 1}; see PalSceneInfo.options. NULL:
     none. */
  const char* options;
} PalSessionInfo;

/* Writes at most `capacity` bytes of the table of options, with the closing zero byte, to `text`
   (NULL if capacity is 0): a JSON list of objects with key, stage ("scene" or "session"), type,
   unit, low, high, words, default, help and c_field; for a host that shows them to people. *length
   becomes the length of the whole text without that byte. [ANY] */
PAL_API PalResult pal_options(char* text, size_t capacity, size_t* length);

/* Starts the session. The force begins at zero and is ramped up over two seconds. [ANY] */
PAL_API PalResult pal_session_open(PalScene* scene, const PalSessionInfo* info,
                                   PalSession** session);

/* Ramps the force to zero and waits for that, at most 0.6 s, then ends all threads of the session.
   A session with PAL_SESSION_HOST_TICKS is ended at once: call pal_session_stop() first, continue
   to tick until pal_session_at_rest() gives 1, then close. The session's views continue to show the
   last state. PAL_BAD_OUTPUT if a recording, a table or a black box could not be written or lacks
   ticks; the session is closed even then. [ANY] */
PAL_API PalResult pal_session_close(PalSession** session);

/* Ramps the force to zero; it does not come back. Waits for the end of the ramp if the haptic
   thread is palpate's. From now on no live frame is taken, and nothing is served. [ANY] */
PAL_API PalResult pal_session_stop(PalSession* session);
/* Returns 1 if the session was stopped and the force has reached zero, else 0. [ANY] */
PAL_API int pal_session_at_rest(const PalSession* session);

typedef struct PalTick {
  double position_m[3]; /* of the grip */
  int64_t time_ns;      /* when it was taken, by a clock that never jumps; 0: now */
  uint32_t buttons;     /* bit k: button k is down */
} PalTick;

/* Computes one haptic frame: gives the force on the hand, N, in the device's space. Call it 250 to
   4,000 times a second, on one thread at a time. Without PAL_SESSION_HOST_TICKS the force is zero
   and the result PAL_BAD_INPUT. A position that is not finite, or a time that does not rise, counts
   as a fault of the device: the force is ramped to zero, and comes back after the hand has been
   free. [RT] */
PAL_API PalResult pal_haptics_tick(PalSession* session, const PalTick* tick, double force_n[3]);

/* With PAL_SESSION_HOST_TICKS: the torque on the grip that belongs to the force of the last
   pal_haptics_tick(), N m, about the grip's position, in the device's space. Zero unless the tool
   has several points. On the thread of the ticks. [RT] */
PAL_API PalResult pal_haptics_torque(PalSession* session, double torque_n_m[3]);

/* With PAL_SESSION_HOST_TICKS: how the grip is held, from the next pal_haptics_tick() on. On the
   thread of the ticks. [RT] */
PAL_API PalResult pal_haptics_hold(PalSession* session, const PalGrip* grip);

enum { PAL_MOST_VOLUMES = 8, PAL_MOST_LIMITERS = 16 };

/* The newest haptic frame. */
typedef struct PalState {
  uint32_t size; /* sizeof(PalState), set before the call */
  uint32_t in_contact;
  int64_t time_ns;              /* of the frame; 0: there was none yet */
  double hand_m[3], proxy_m[3]; /* world */
  double force_n[3];            /* on the hand, along the world's axes */
  const char* cause; /* why the force is not the scene's, as a word ("late"), or ""; static */
  const char* cause_sentence;  /* the same as a sentence; static */
  uint32_t can_play;           /* 0: the motion is not known yet */
  uint32_t steps, steps_known; /* of the motion that the session estimates: all, and those found */
  uint32_t volume_count;
  struct {
    double world_from_volume[12];
    double time_s; /* of its sequence */
    double rate;   /* of playback, s per s */
  } volumes[PAL_MOST_VOLUMES];
  uint64_t ticks, late_ticks; /* so far; late: later than the watchdog allows */
  /* For a live source: the number of frames that arrived; the number that were felt; the median of
     the delay from arriving to being felt, s. frame_cycle_s: while the frames repeat and a cycle of
     them is felt, its length; else 0. */
  uint64_t frames_received, frames_felt;
  double frame_delay_s, frame_cycle_s;
  /* Where the newtons of the frame went, along the world's axes: asked_n (of the spring between
     hand and proxy, had nothing limited it) minus all held_n is force_n. The word of a limiter is
     static text ("first-contact"); docs/force-limits.md explains each. hand_work_j: the work that
     all forces so far did on the hand; negative where the hand worked. */
  double hand_work_j;
  double asked_n[3];
  uint32_t limiter_count, reserved; /* reserved: 0 */
  struct {
    const char* word;
    double held_n[3];
  } limiters[PAL_MOST_LIMITERS];
  double shaft[3]; /* world, unit: from the hand along the grip's shaft; 0: it is not sensed */
  /* On the grip, along the world's axes: of a tool of several points, also where the device gives
     none. */
  double torque_n_m[3];
} PalState;

/* Gives the newest haptic frame. May wait shortly for other threads that read the session's state;
   never for the haptic thread. [ANY] */
PAL_API PalResult pal_session_state(PalSession* session, PalState* state);

/* A volume of the scene as it is in the newest haptic frame. */
typedef struct PalVolumeState {
  uint32_t size;                /* sizeof(PalVolumeState), set before the call */
  uint32_t reserved;            /* 0 */
  double world_from_volume[12]; /* three rows of four */
  double time_s;                /* of its sequence */
  double rate;                  /* of playback, s per s */
} PalVolumeState;

/* Gives volume `index` as in PalState.volumes, which can not grow. PAL_NOT_YET before the first
   haptic frame, PAL_END after the last volume. Waits as pal_session_state() does. [ANY] */
PAL_API PalResult pal_session_volume(PalSession* session, uint32_t index, PalVolumeState* volume);

/* Gives the next frame of a scene with PAL_SCENE_LIVE. For each frame the motion from the frame
   that is felt to the new one is estimated, which takes some tenths of a second, and the material
   follows it. Of the frames that arrive meanwhile only the last one is used. grid: the frame's
   grid; NULL: that of the first frame. A frame on another grid is resampled onto that of the first
   frame; a frame without any overlap with it is left out, and an event of kind PAL_EVENT_NOTE says
   so. time_ns: CLOCK_MONOTONIC when the frame was taken, from which delays and cycles are counted;
   0: now. The samples are read during the call. Frames are felt in the order of these calls: give
   them from one thread. [ANY] */
PAL_API PalResult pal_session_push_frame(PalSession* session, const PalGrid* grid,
                                         PalSampleType type, const void* samples, int64_t time_ns);

/* Plays (on: not 0) or pauses; PAL_NOT_YET while the motion is not known. The rate changes by a
   ramp. [ANY] */
PAL_API PalResult pal_session_play(PalSession* session, int on);
/* Sets the time of every moving volume to a share of its sequence's length, 0 to 1, and pauses;
   PAL_NOT_YET while the motion is not known. [ANY] */
PAL_API PalResult pal_session_scrub(PalSession* session, double share);
/* Switches mode `index` of the scene on or off and sets a factor on its strengths, 0 to 100, by a
   ramp. PAL_NOT_YET: too many requests wait for the haptic loop; nothing is changed, call again.
   [ANY] */
PAL_API PalResult pal_session_set_mode(PalSession* session, uint32_t index, int on, double gain);
/* Sets the place of a movable volume: a rotation, scales along its axes (equal or not) and a
   translation, three rows of four. The volume moves there on a smooth path, so one call per picture
   is enough. PAL_NOT_YET as above. [ANY] */
PAL_API PalResult pal_session_place(PalSession* session, uint32_t volume,
                                    const double world_from_volume[12]);
/* Lets the force come back after an oscillation that went on although the force was reduced (cause
   "oscillation"). After the other causes it comes back without this call, once the hand is free;
   after pal_session_stop() it does not come back. PAL_NOT_YET as above. [ANY] */
PAL_API PalResult pal_session_rearm(PalSession* session);

/* ---- stream tubes ----

   A stream tube is the field line through the place where the proxy was at one instant. The field
   is the one that is felt: vectors, or the gradient that guides; where there is neither, the
   velocity of the moving material. From then on the tube is part of the material and moves with it.
   pal_view_render() draws the tubes. There are at most 64; one more removes the oldest that is not
   kept. */

typedef enum PalTubesAction {
  PAL_TUBES_RELEASE = 0,     /* lay a tube through the proxy at the next tick */
  PAL_TUBES_KEEP = 1,        /* mark the present tubes as kept: clearing leaves them */
  PAL_TUBES_CLEAR = 2,       /* remove the tubes that are not kept; if all are kept, remove all */
  PAL_TUBES_MAX = 0x7fffffff /* not an action: any number fits, wrong ones are refused */
} PalTubesAction;

/* Takes effect with the next tick; pal_session_tube() gives the result some hundredths of a second
   later. Where there is no field at the proxy, an event of kind PAL_EVENT_NOTE says why.
   PAL_NOT_YET: the queue of requests is full. [ANY] */
PAL_API PalResult pal_session_ask_tubes(PalSession* session, PalTubesAction action);

typedef enum PalTubeField {
  PAL_TUBE_VECTORS = 0,
  PAL_TUBE_GRADIENT = 1,
  PAL_TUBE_CURL = 2,
  PAL_TUBE_VELOCITY = 3
} PalTubeField;

/* A stream tube as it is at the newest tick. */
typedef struct PalTube {
  uint32_t size;   /* sizeof(PalTube), set before the call */
  uint32_t volume; /* of the scene, through which it runs */
  uint32_t is_kept;
  uint32_t is_closed; /* 1: its last point is its first */
  PalTubeField field; /* the field that it followed */
  uint32_t point_count;
  uint32_t seed_point; /* the index of the point that was at the proxy */
  /* Number of points for which the arrays below have room, set before the call; if there are more
     points, the first ones are given. */
  uint32_t capacity;
  double* points_m; /* 3 * capacity numbers, world, in order along the tube; NULL: not given */
  /* capacity numbers: the length of the field's vector at each point when the tube was laid; NULL:
     not given. */
  double* lengths;
  const char* length_unit; /* "data", "data per m" or "m/s"; static */
} PalTube;

/* Gives tube `index`, the oldest first; PAL_END after the last one. Each action may change which
   tube has an index: use point_count of this call, since that of an earlier call may be of another
   tube. [ANY] */
PAL_API PalResult pal_session_tube(PalSession* session, uint32_t index, PalTube* tube);

/* Writes all tubes as lines for ParaView and 3D Slicer (.vtk, mm, LPS), at the places where they
   were laid, with the displacement that takes each point to the first frame. PAL_BAD_OUTPUT if the
   file could not be written; there is no partial file then. [ANY] */
PAL_API PalResult pal_session_save_tubes(PalSession* session, const char* path);

/* ---- views ----

   Pictures of what is felt, by the context's device. */

typedef struct PalView PalView;

enum {
  /* Draw no pen, proxy and force. */
  PAL_VIEW_NO_HAND = 1u << 0,
  /* Draw neither the edges of the data nor the letters of the patient's sides. */
  PAL_VIEW_NO_BOX = 1u << 1,
  /* Draw nothing that lies between the eye and a plane through the touched place. */
  PAL_VIEW_CUT_OPEN = 1u << 2,
  /* Nothing is behind the scene: pal_view_read() gives colours multiplied by their opacity (in
     linear light, then encoded as sRGB), to be blended over a picture of the host's. */
  PAL_VIEW_NO_BACKGROUND = 1u << 3,
  /* No ambient occlusion and no soft shadows of the volumes: less work. */
  PAL_VIEW_NO_SHADOWS = 1u << 4
};

typedef struct PalViewInfo {
  uint32_t size;          /* sizeof(PalViewInfo) */
  uint32_t flags;         /* PAL_VIEW_... */
  uint32_t width, height; /* of the largest picture of an eye */
  uint32_t eye_count;     /* the most eyes of a picture: 1 or 2 */
  /* A transfer function, as the program's option --look; NULL: chosen from the data. */
  const char* look;
} PalViewInfo;

/* Opens a view and uploads the data. This takes time: do not call it in the picture loop. [ANY] */
PAL_API PalResult pal_view_open(PalSession* session, const PalViewInfo* info, PalView** view);
/* Closes a view, after waiting for the picture that is being drawn. [ANY] */
PAL_API PalResult pal_view_close(PalView** view);

/* An eye, as in OpenXR. */
typedef struct PalEye {
  double position_m[3]; /* world */
  /* World from eye, a unit quaternion x, y, z, w. The eye looks along its -z axis; its y axis is
     up. */
  double orientation[4];
  /* Tangents of the angles of view; left and down are below 0. */
  double tan_left, tan_right, tan_down, tan_up;
} PalEye;

/* The host's images into which a picture is drawn, on the Vulkan device that the context shares
   with the host. The picture is composed with what the host has drawn there, by depth: the host's
   surfaces hide what is behind them and are seen through what is in front of them. The images must
   have one sample per pixel, the picture's size, and usage for transfers from and to them. Handles
   and enumerations are Vulkan's (VkImage, VkFormat, VkImageLayout). */
typedef struct PalImages {
  uint32_t size;         /* sizeof(PalImages) */
  uint32_t writes_depth; /* 1: write the depth at which a volume has absorbed half the light */
  uint64_t colour[2], depth[2]; /* VkImage per eye; depth 0: all that the host drew is behind */
  uint32_t colour_layer[2], depth_layer[2];
  /* R8G8B8A8 or B8G8R8A8, _UNORM or _SRGB; D32_SFLOAT, D32_SFLOAT_S8_UINT, X8_D24_UNORM_PACK32 or
     D24_UNORM_S8_UINT. */
  uint32_t colour_format, depth_format;
  uint32_t colour_layout, depth_layout;    /* the layouts before and after the call */
  double inverse_depth_0, inverse_depth_1; /* 1 / z where the depth is 0, and where it is 1; 1/m */
} PalImages;

/* Submits a picture of the session as it will be `ahead_s` seconds from now, and does not wait for
   it. With images: draws into these, on the shared queue, in order with the host's own submissions.
   With NULL: draws for pal_view_read(). One thread at a time. */
PAL_API PalResult pal_view_render(PalView* view, const PalEye* eyes, uint32_t eye_count,
                                  uint32_t width, uint32_t height, double ahead_s,
                                  const PalImages* images);
/* Waits for the last picture. One thread at a time. */
PAL_API PalResult pal_view_wait(PalView* view);
/* Gives the last picture of an eye, width * height pixels, rows from the top. rgba: R in the lowest
   byte, then G, B (sRGB) and opacity. depth_m: depth along the eye's axis, m, 0 where nothing is
   drawn. Either may be NULL. One thread at a time. */
PAL_API PalResult pal_view_read(PalView* view, uint32_t eye, uint32_t* rgba, float* depth_m);

#ifdef __cplusplus
}
#endif

#endif /* PALPATE_H */
