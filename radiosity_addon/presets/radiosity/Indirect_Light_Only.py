import bpy

radiosity = bpy.context.scene.radiosity

radiosity.target = 'IMAGE'
radiosity.resolution = 512
radiosity.quality = 'HIGH'
radiosity.passes = {'INDIRECT'}
