# A scene in a headset: the volume before the person's eyes, a blue cube of the engine's before it, and a green one in its middle.
# User arguments: a file that appears once the volume is shown, the file that ends this program when it appears, inputs of the scene.
extends SceneTree

var files := OS.get_cmdline_user_args()
var scene := PalpateScene.new()
var volume := PalpateVolume.new()

func _initialize() -> void:
	var headset := XRServer.find_interface("OpenXR")
	if headset == null or not headset.is_initialized():
		end({"failed": "There is no headset"})
		return
	root.use_xr = true
	var origin := XROrigin3D.new()
	origin.add_child(XRCamera3D.new())
	root.add_child(origin)
	scene.inputs = files.slice(2)
	scene.black_box = "off"
	scene.motion = false
	scene.watchdog_s = 1.0
	scene.real_time = false
	scene.position = Vector3(0, 1.6, -0.3)
	volume.draws_hand = false
	volume.draws_box = false
	scene.failed.connect(func(sentence): end({"failed": sentence}))
	volume.failed.connect(func(sentence): end({"failed": sentence}))
	volume.shown.connect(func(): FileAccess.open(files[0], FileAccess.WRITE).store_string("shown"))
	scene.add_child(volume)
	root.add_child(scene)
	cube(scene.position + Vector3(0, 0, 0.1), Color.BLUE)
	cube(scene.position, Color.GREEN)

func cube(at: Vector3, colour: Color) -> void:
	var box := MeshInstance3D.new()
	box.mesh = BoxMesh.new()
	box.mesh.size = Vector3.ONE * 0.02
	box.mesh.material = StandardMaterial3D.new()
	box.mesh.material.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
	box.mesh.material.albedo_color = colour
	box.position = at
	root.add_child(box)

func _process(_delta: float) -> bool:
	if FileAccess.file_exists(files[1]):
		end({})
	return false

func end(said: Dictionary) -> void:
	scene.close()
	print("RESULT ", JSON.stringify(said))
	quit()
