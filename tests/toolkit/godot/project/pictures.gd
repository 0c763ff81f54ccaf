# The picture of a scene without a camera of its own, compared with the program's; then cubes of the engine's before and behind the volume.
# User arguments: the program's picture, files for three pictures, a recording of the scene and its known motion ("": none), inputs of the scene.
extends SceneTree

var files := OS.get_cmdline_user_args()
var scene := PalpateScene.new()
var volume := PalpateVolume.new()
var said := {}

func _initialize() -> void:
	scene.inputs = files.slice(6)
	scene.fields = files[5]
	scene.black_box = "off"
	# As large as it is, as in the program's picture: a hand reaches all of it. A recording is of a scene that fits its hand.
	var hand := PalpateHand.new()
	hand.reach_m = 0.2
	hand.position.z = 0.19
	scene.add_child(hand)
	scene.watchdog_s = 1.0
	scene.real_time = false
	volume.draws_hand = false
	scene.opened.connect(func(): scene.play(false); scene.scrub(0.0))
	scene.failed.connect(end)
	volume.failed.connect(end)
	volume.shown.connect(compare)
	scene.add_child(volume)
	root.add_child(scene)

# What `palpate view` has behind the volume, far away.
func background() -> MeshInstance3D:
	var shader := Shader.new()
	shader.code = "
		shader_type spatial;
		render_mode unshaded;
		uniform vec3 top : source_color = vec3(0.105, 0.125, 0.16);
		uniform vec3 bottom : source_color = vec3(0.03, 0.035, 0.05);
		void fragment() { ALBEDO = mix(top, bottom, SCREEN_UV.y); }"
	var material := ShaderMaterial.new()
	material.shader = shader
	var wall := MeshInstance3D.new()
	wall.mesh = QuadMesh.new()
	wall.mesh.size = Vector2(100, 100)
	wall.mesh.material = material
	wall.position.z = -10
	return wall

func picture(file: String) -> Image:
	for _k in 3:
		await RenderingServer.frame_post_draw
	var image := root.get_texture().get_image()
	image.convert(Image.FORMAT_RGB8)
	image.save_png(file)
	return image

func compare() -> void:
	root.get_camera_3d().add_child(background())
	var reference := Image.load_from_file(files[0])
	reference.convert(Image.FORMAT_RGB8)
	# Below the volume the program writes what it shows.
	reference = reference.get_region(Rect2i(0, 0, reference.get_width(), reference.get_width()))
	if files[4] != "":
		said.replay = scene.replay(files[4])
	var alone := await picture(files[1])
	said.peak_snr = alone.compute_image_metrics(reference, false).peak_snr
	# A cube between the camera and the middle of the volume, and one behind it.
	var camera := root.get_camera_3d()
	var middle := camera.global_position * 0.02
	cube(camera.global_position * 0.6)
	cube(camera.global_position * -0.6)
	var with_cubes := await picture(files[2])
	var before := camera.unproject_position(camera.global_position * 0.6)
	said.before = near(with_cubes, alone, before)
	for child in root.get_children():
		if child.name == "cube":
			child.queue_free()
			break
	said.behind = near(await picture(files[3]), alone, camera.unproject_position(middle))
	end()

# The colour at a place, with and without the cubes.
func near(image: Image, other: Image, place: Vector2) -> Array:
	return [image, other].map(func(of): return of.get_pixelv(place).to_rgba32() >> 8)

func cube(at: Vector3) -> void:
	var box := MeshInstance3D.new()
	box.name = "cube"
	box.mesh = BoxMesh.new()
	box.mesh.size = Vector3.ONE * 0.02
	box.mesh.material = StandardMaterial3D.new()
	box.mesh.material.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
	box.mesh.material.albedo_color = Color.BLUE
	box.position = at
	root.add_child(box, true)

func end(sentence = null) -> void:
	if sentence:
		said.failed = sentence
	print("RESULT ", JSON.stringify(said))
	quit()
