#include "nodes.h"

using namespace palpate::godot;

namespace {

void initialise(void*, GDExtensionInitializationLevel level) {
  if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
  register_class(SceneNode::class_row());
  register_class(HandNode::class_row());
  register_class(VolumeNode::class_row());
}

void end(void*, GDExtensionInitializationLevel level) {
  if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
  unregister_class(VolumeNode::class_row());
  unregister_class(HandNode::class_row());
  unregister_class(SceneNode::class_row());
}

}  // namespace

/// What palpate.gdextension names.
extern "C" __attribute__((visibility("default"))) GDExtensionBool palpate_godot_init(
    GDExtensionInterfaceGetProcAddress find, GDExtensionClassLibraryPtr library,
    GDExtensionInitialization* initialization) {
  if (!load_functions(find, library)) return false;
  initialization->minimum_initialization_level = GDEXTENSION_INITIALIZATION_SCENE;
  initialization->userdata = nullptr;
  initialization->initialize = initialise;
  initialization->deinitialize = end;
  return true;
}
