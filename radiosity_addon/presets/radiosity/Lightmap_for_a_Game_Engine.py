import bpy

radiosity = bpy.context.scene.radiosity

radiosity.target = 'IMAGE'
radiosity.resolution = 1024
radiosity.margin = 8
radiosity.quality = 'MEDIUM'
radiosity.passes = {'DIRECT', 'INDIRECT'}
radiosity.write_files = True
radiosity.format = 'HDR'
